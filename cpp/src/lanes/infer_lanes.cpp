// The innovations filter, compiled once per instruction set.
#include "driftwalk/infer/filter_kernel.hpp"
#include "driftwalk/infer/lanes.hpp"
#include "driftwalk/physics/laws/mixed.hpp"

DRIFTWALK_LANES_BEGIN

namespace {
MixedDrag<double> drag_law(const FilterProblem& problem) {
  return {problem.law.quadratic, problem.law.linear};
}

template <int D, int F>
void run_filter(const FilterProblem& problem, FilterState<D, F>& state,
                const FilterScratch<D>& scratch, const FilterOutputs& out, const ProductSums* sums,
                std::int64_t count) {
  FilterRun<D, F, MixedDrag<double>>(drag_law(problem), problem, state, scratch, out, sums)
      .run(count);
}

template <int D>
DragResponse<D> drag_alone(const FilterProblem& problem, double theta, double omega,
                           const double* mean, const double (*covariance)[2 * D],
                           StripShare<D>* shares, PointShare<D>* points, double* by_coefficients) {
  const UncertainBlock<D> block{mean[0], mean[1], mean[D], mean[D + 1], omega, covariance};
  DragResponse<D> drag =
      expected_drag<D>(drag_law(problem), problem.law.power, problem.flow, problem.block,
                       problem.orientations, theta, block, shares);
  const double known = problem.orientations.count == 0 ? theta : 0;
  add_water_acceleration<D>(problem.flow, nullptr, problem.block, problem.law, __builtin_cos(known),
                            __builtin_sin(known), block, points, drag);
  const std::int64_t nodes = std::int64_t(problem.flow.rows) * problem.flow.columns;
  double* rows[D];
  for (int a = 0; a < D; ++a) {
    rows[a] = by_coefficients == nullptr ? nullptr : by_coefficients + 2 * nodes * a;
  }
  for (int k = 0; k < drag.shares; ++k) {
    add_share<D>(shares[k], problem.flow.columns, nodes, shares[k].response, -1, rows);
  }
  for (int k = 0; points != nullptr && k < drag.points; ++k) {
    add_point<D>(points[k], problem.flow.columns, nodes, points[k].by_value, points[k].by_slope,
                 rows);
  }
  return drag;
}

constexpr InferKernel kernel{{run_filter<2, 0>, run_filter<2, 2>, drag_alone<2>},
                             {run_filter<3, 0>, run_filter<3, 2>, drag_alone<3>}};
} // namespace

DRIFTWALK_LANES_END

driftwalk::InferKernel driftwalk::DRIFTWALK_PER_ISA(infer_kernel_)() {
  return kernel;
}
