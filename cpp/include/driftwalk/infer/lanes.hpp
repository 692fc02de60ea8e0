// The kernels of the innovations filter that this build holds.
#pragma once

#include "driftwalk/infer/problem.hpp"

namespace driftwalk {

template <int D>
struct InferKernelOf {
  // Takes the filter over the next `count` samples. With sums, which may be null, whitened
  // innovations and derivatives are not handed out.
  template <int F>
  using Run = void (*)(const FilterProblem&, FilterState<D, F>&, const FilterScratch<D>&,
                       const FilterOutputs&, const ProductSums*, std::int64_t count);
  Run<0> run;
  Run<2> run_with_memory; // of the force
  // The mean acceleration at one state, and its derivative by the coefficients (D rows of rows *
  // columns * 2 numbers, zero before) through `shares` and `points`. `mean` and `covariance` as in
  // UncertainBlock.
  DragResponse<D> (*drag)(const FilterProblem&, double theta, double omega, const double* mean,
                          const double (*covariance)[2 * D], StripShare<D>* shares,
                          PointShare<D>* points, double* by_coefficients);
};

struct InferKernel {
  InferKernelOf<2> position; // the angle is an input, or unknown
  InferKernelOf<3> pose;     // the angle is a part of the state
};

// The kernel of the chosen instruction set (dispatch.hpp).
InferKernel chosen_infer_kernel();

InferKernel infer_kernel_baseline();
InferKernel infer_kernel_avx2();
InferKernel infer_kernel_avx512();

} // namespace driftwalk
