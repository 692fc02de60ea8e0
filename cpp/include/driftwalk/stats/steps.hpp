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

// Cross and dot product of the two steps of a pair, and the squares of their lengths.
struct StepPairs {
  static constexpr int size = 128;
  double cross[size];
  double dot[size];
  double before[size];
  double after[size];
};

template <class T>
inline void load_step_pairs(const StepPlanView& plan, const T* x, const T* y, std::int64_t begin,
                            int count, StepPairs& pairs) {
  for (int i = 0; i < count; ++i) {
    const std::int64_t first = plan.triple[begin + i];
    const StepPoint a = step_point(plan, x, y, first);
    const StepPoint b = step_point(plan, x, y, first + 1);
    const StepPoint c = step_point(plan, x, y, first + 2);
    const double ux = b.x - a.x;
    const double uy = b.y - a.y;
    const double vx = c.x - b.x;
    const double vy = c.y - b.y;
    pairs.cross[i] = ux * vy - uy * vx;
    pairs.dot[i] = ux * vx + uy * vy;
    pairs.before[i] = ux * ux + uy * uy;
    pairs.after[i] = vx * vx + vy * vy;
  }
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
  StepPairs pairs;
  double angles[StepPairs::size];
  std::int64_t written = 0;
  std::int64_t zero = 0;
  std::int64_t missing = 0;
  for (std::int64_t begin = 0; begin < plan.pairs; begin += StepPairs::size) {
    const std::int64_t left = plan.pairs - begin;
    const int count = left < StepPairs::size ? static_cast<int>(left) : StepPairs::size;
    load_step_pairs(plan, x, y, begin, count, pairs);
    for (int i = 0; i < count; ++i) {
      angles[i] = turning_angle(pairs.cross[i], pairs.dot[i]);
    }
    for (int i = 0; i < count; ++i) {
      const double sum = pairs.before[i] + pairs.after[i];
      if (!(sum - sum == 0.0)) { // NaN or infinite
        ++missing;
        continue;
      }
      if (pairs.before[i] == 0.0 || pairs.after[i] == 0.0) {
        ++zero;
        continue;
      }
      length[written] = __builtin_sqrt(pairs.after[i]);
      angle[written] = angles[i];
      if (kept != nullptr) {
        kept[written] = static_cast<std::int32_t>(begin + i);
      }
      ++written;
    }
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
