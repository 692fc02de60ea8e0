// Batches of one-block worlds: as trajectories, or scored against a recording as they finish.
#pragma once

#include "driftwalk/simulate/prepare.hpp"
#include "driftwalk/stats/ks2d.hpp"
#include "driftwalk/stats/step_plan.hpp"

namespace driftwalk {

// Outputs of simulate_batch: [world][sample]; theta may be null.
template <class T>
struct Trajectories {
  T* x;
  T* y;
  T* theta;
  std::uint32_t* status; // [world]
};

void simulate_batch(const PreparedRun<float>& run, const BatchWorlds& worlds, int threads,
                    const Trajectories<float>& out);
void simulate_batch(const PreparedRun<double>& run, const BatchWorlds& worlds, int threads,
                    const Trajectories<double>& out);

// What a recording asks of a simulated world.
struct Scoring {
  StepPlanView plan;
  const KsReference* reference = nullptr; // the recording's steps; null: no distance wanted
  // joint density of step length and turning angle, length_bins x angle_bins
  int length_bins = 0, angle_bins = 0;
  // The bins cover [0, length_limit] [m] and [-angle_limit, angle_limit] [rad]; a step beyond
  // counts in the last bin on its side.
  double length_limit = 0, angle_limit = 0;
  std::int64_t excerpt = 0; // samples kept from the start
};

// Outputs of score_batch, one row per world; any pointer but `status` and `pairs` may be null.
struct Scores {
  double* distance = nullptr;
  double* place_length = nullptr; // where the KS maximum sits
  double* place_angle = nullptr;
  std::int32_t* place_quadrant = nullptr;
  std::int64_t* pairs = nullptr;
  std::uint32_t* status = nullptr;
  float* density = nullptr;   // [world][length_bins][angle_bins], fractions
  float* excerpt_x = nullptr; // [world][excerpt]
  float* excerpt_y = nullptr;
  double* length = nullptr; // [world][plan.pairs]: the steps themselves
  double* angle = nullptr;
};

void score_batch(const PreparedRun<float>& run, const BatchWorlds& worlds, const Scoring& scoring,
                 int threads, const Scores& out);

// Steps of many recordings: row r holds count[r] values from r * stride on.
struct StepTable {
  const double* length;
  const double* angle;
  const std::int64_t* count;
  std::int64_t rows, stride;
};

// KS distance of every row of `references` to every row of `samples`, [reference][sample].
void ks_matrix(const StepTable& references, const StepTable& samples, int threads, double* out);

} // namespace driftwalk
