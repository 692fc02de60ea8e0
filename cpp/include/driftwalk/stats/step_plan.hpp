// Which positions form steps: built once from the time stamps, applied to every trajectory.
#pragma once

#include <cstdint>

namespace driftwalk {

// Resampled point k is (1 - weight[k]) p[left[k]] + weight[k] p[left[k] + 1]; where the weight is
// zero the right neighbour is not read. Pair i is formed of the points triple[i], +1, +2.
struct StepPlanView {
  const std::int32_t* left;   // (points)
  const double* weight;       // (points)
  const std::int32_t* triple; // (pairs)
  std::int64_t points;
  std::int64_t pairs;
};

} // namespace driftwalk
