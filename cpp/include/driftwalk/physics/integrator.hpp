// One time step of a block: second order in time with a single evaluation of the drag.
//
//     v* = v + dt/2 (a- + e)          a-: drag acceleration of the previous step, e: stochastic
//     x* = x + dt/4 (v + v*)          b = drag/m and S (conductance) at (x*, v*)
//     vm = v* + dt/2 (b - a-) / (1 + dt/2 K S/m)
//     x' = x + dt vm,   v' = 2 vm - v,   a- = (v' - v)/dt - e
// and the same for the angle, with S_R = 4/3 h^2 S. The denominator keeps the step stable where
// drag is stiff. a- is 0 at the start and after a wall impulse.
#pragma once

#include "driftwalk/math/elementary.hpp"
#include "driftwalk/physics/wall.hpp"

DRIFTWALK_LANES_BEGIN

template <class Real>
struct World {
  Pose<Real> pose;
  Motion<Real> motion;
  Motion<Real> drag; // a-: [m/s^2, m/s^2, rad/s^2]
};

// What a world keeps through a run.
template <class Real>
struct WorldConstants {
  Real drag_per_mass;    // K/m [1/m]
  Real drag_per_inertia; // K/I [1/m^3]
};

template <class Real, class T>
inline void step_world(const BlockShape<T>& block, const FlowView<T>& flow, const WallView<T>& wall,
                       const StepConstants<T>& step, const WorldConstants<Real>& constants,
                       Real noise_x, Real noise_y, World<Real>& w, Real& turned) {
  const T dt = step.dt, half = T(0.5) * dt, quarter = T(0.25) * dt;
  const Motion<Real> v = w.motion;
  Motion<Real> ahead;
  ahead.vx = v.vx + (w.drag.vx + noise_x) * half;
  ahead.vy = v.vy + (w.drag.vy + noise_y) * half;
  ahead.omega = v.omega + w.drag.omega * half;
  // The clamp is for memory safety alone: a NaN or a runaway stays on the table.
  const Real x = clamp_to(w.pose.x + (v.vx + ahead.vx) * quarter, flow.low_x, flow.high_x);
  const Real y = clamp_to(w.pose.y + (v.vy + ahead.vy) * quarter, flow.low_y, flow.high_y);
  const Real theta = w.pose.theta + (v.omega + ahead.omega) * quarter;
  Axes<Real> axes;
  sincos(bounded_angle(theta), axes.sine, axes.cosine);

  const DragSums<Real> sums = drag_sums(block, flow, x, y, axes, ahead);
  const Real one{T(1)};
  const Real damping = one / (one + sums.conductance * constants.drag_per_mass * half);
  const T turning = T(4.0 / 3.0) * block.half_side * block.half_side * half;
  const Real spin_damping = one / (one + sums.conductance * constants.drag_per_inertia * turning);

  Motion<Real> mean;
  mean.vx = ahead.vx + (sums.force_x * constants.drag_per_mass - w.drag.vx) * damping * half;
  mean.vy = ahead.vy + (sums.force_y * constants.drag_per_mass - w.drag.vy) * damping * half;
  mean.omega =
      ahead.omega + (sums.torque * constants.drag_per_inertia - w.drag.omega) * spin_damping * half;
  w.pose.x = w.pose.x + mean.vx * dt;
  w.pose.y = w.pose.y + mean.vy * dt;
  turned = mean.omega * dt;
  w.pose.theta = wrap_angle(w.pose.theta + turned);
  w.motion.vx = mean.vx * T(2) - v.vx;
  w.motion.vy = mean.vy * T(2) - v.vy;
  w.motion.omega = mean.omega * T(2) - v.omega;
  w.drag.vx = (w.motion.vx - v.vx) * step.per_dt - noise_x;
  w.drag.vy = (w.motion.vy - v.vy) * step.per_dt - noise_y;
  w.drag.omega = (w.motion.omega - v.omega) * step.per_dt;

  const auto touched = meet_wall(wall, block.half_side, Real(step.per_inertia), w.pose, w.motion);
  if (any(touched)) {
    const Real zero{T(0)};
    w.drag.vx = select(touched, zero, w.drag.vx);
    w.drag.vy = select(touched, zero, w.drag.vy);
    w.drag.omega = select(touched, zero, w.drag.omega);
  }
}

DRIFTWALK_LANES_END
