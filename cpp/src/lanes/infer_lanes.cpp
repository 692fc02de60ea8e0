// The innovations filter, compiled once per instruction set.
#include "driftwalk/infer/filter_kernel.hpp"
#include "driftwalk/infer/lanes.hpp"

DRIFTWALK_LANES_BEGIN

namespace {
void run_filter(const FilterProblem& problem, FilterState& state, const FilterScratch& scratch,
                const FilterOutputs& out, std::int64_t count) {
  FilterRun(problem, state, scratch, out).run(count);
}

DragResponse drag_alone(const FilterProblem& problem, double theta, double omega,
                        const double mean[4], const double (*covariance)[4], StripShare* shares,
                        double* by_coefficients) {
  const UncertainBlock block{mean[0], mean[1], mean[2], mean[3], omega, covariance};
  const DragResponse drag =
      expected_drag(problem.flow, problem.block, problem.orientations, theta, block, shares);
  const std::int64_t nodes = std::int64_t(problem.flow.rows) * problem.flow.columns;
  for (int k = 0; k < drag.shares; ++k) {
    add_share(shares[k], problem.flow.columns, nodes, shares[k].response, -1, by_coefficients,
              by_coefficients + 2 * nodes);
  }
  return drag;
}
} // namespace

inline constexpr InferKernel kernel{run_filter, drag_alone};

DRIFTWALK_LANES_END

driftwalk::InferKernel driftwalk::DRIFTWALK_PER_ISA(infer_kernel_)() {
  return kernel;
}
