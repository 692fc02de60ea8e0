// Steps of a correlated random walk: step lengths and turning angles of a sampled path.
#pragma once

#include "driftwalk/config.hpp"
#include "driftwalk/math/atan2.hpp"
#include "driftwalk/stats/step_plan.hpp"

#include <cstdint>

DRIFTWALK_LANES_BEGIN

struct StepPoint {
  double x;
  double y;
};

template <class T>
inline StepPoint step_point(const StepPlanView& plan, const T* x, const T* y, std::int64_t k) {
  const std::int32_t left = plan.left[k];
  const double weight = plan.weight[k];
  const double x0 = static_cast<double>(x[left]);
  const double y0 = static_cast<double>(y[left]);
  if (weight == 0.0) {
    return {x0, y0};
  }
  return {(1.0 - weight) * x0 + weight * static_cast<double>(x[left + 1]),
          (1.0 - weight) * y0 + weight * static_cast<double>(y[left + 1])};
}

// Write the pairs (length of the second step [m], signed angle from the first step to the second
// [rad] in (-pi, pi]) of a plan and return how many were written.
//
// `length` and `angle` have room for plan.pairs values. A pair with a step of zero length has no
// angle, and one with a position that is not finite has no length: both are left out and counted.
// `kept`, where given, receives the index of the pair in the plan of every pair written.
template <class T>
inline std::int64_t apply_step_plan(const StepPlanView& plan, const T* x, const T* y,
                                    double* length, double* angle, std::int64_t* dropped_zero,
                                    std::int64_t* dropped_missing = nullptr,
                                    std::int32_t* kept = nullptr) {
  std::int64_t written = 0;
  std::int64_t zero = 0;
  std::int64_t missing = 0;
  for (std::int64_t i = 0; i < plan.pairs; ++i) {
    const std::int64_t first = plan.triple[i];
    const StepPoint a = step_point(plan, x, y, first);
    const StepPoint b = step_point(plan, x, y, first + 1);
    const StepPoint c = step_point(plan, x, y, first + 2);
    const double ux = b.x - a.x;
    const double uy = b.y - a.y;
    const double vx = c.x - b.x;
    const double vy = c.y - b.y;
    const double before = ux * ux + uy * uy;
    const double after = vx * vx + vy * vy;
    const double sum = before + after;
    if (!(sum - sum == 0.0)) { // NaN or infinite
      ++missing;
      continue;
    }
    if (before == 0.0 || after == 0.0) {
      ++zero;
      continue;
    }
    length[written] = __builtin_sqrt(after);
    angle[written] = turning_angle(ux * vy - uy * vx, ux * vx + uy * vy);
    if (kept != nullptr) {
      kept[written] = static_cast<std::int32_t>(i);
    }
    ++written;
  }
  if (dropped_zero != nullptr) {
    *dropped_zero = zero;
  }
  if (dropped_missing != nullptr) {
    *dropped_missing = missing;
  }
  return written;
}

DRIFTWALK_LANES_END
