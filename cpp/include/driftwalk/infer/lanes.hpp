// The kernels of the innovations filter that this build holds.
#pragma once

#include "driftwalk/infer/problem.hpp"

namespace driftwalk {

struct InferKernel {
  // Takes the filter over the next `count` samples.
  void (*run)(const FilterProblem&, FilterState&, const FilterScratch&, const FilterOutputs&,
              std::int64_t count);
  // The mean drag at one state, and its derivative by the coefficients (2 rows of rows * columns *
  // 2 numbers, zero before) through `shares`.
  DragResponse (*drag)(const FilterProblem&, double theta, double omega, const double mean[4],
                       const double (*covariance)[4], StripShare* shares, double* by_coefficients);
};

// The kernel of the chosen instruction set (dispatch.hpp).
InferKernel chosen_infer_kernel();

InferKernel infer_kernel_baseline();
InferKernel infer_kernel_avx2();
InferKernel infer_kernel_avx512();

} // namespace driftwalk
