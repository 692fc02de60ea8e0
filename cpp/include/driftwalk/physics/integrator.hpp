// One time step of a rigid body: second order in time with a single evaluation of the drag.
//
//     v* = v + dt/2 (a- + e)          a-: drag acceleration of the previous step, e: stochastic
//     x* = x + dt/4 (v + v*)          b: drag acceleration, S: conductance, at (x*, v*)
//     vm = v* + dt/2 (b - a-) / (1 + dt/2 K S/m)
//     x' = x + dt vm,   v' = 2 vm - v,   a- = (v' - v)/dt - e
// and the same for the angle. The denominator keeps the step stable where drag is stiff. a- is 0 at
// the start and after a wall impulse.
//
// `look_ahead` gives x* and v*, `finish_step` does the rest. What comes between them, the drag at
// (x*, v*), is of one block (simulate/step.hpp) or summed over an assembly (assembly/advance.hpp).
#pragma once

#include "driftwalk/physics/body.hpp"
#include "driftwalk/simulate/prepared.hpp"

DRIFTWALK_LANES_BEGIN

template <class Real>
struct Body {
  Pose<Real> pose;
  Motion<Real> motion;
  Motion<Real> drag; // a-: [m/s^2, m/s^2, rad/s^2]
};

// x*, v*
template <class Real>
struct Ahead {
  Pose<Real> pose;
  Motion<Real> motion;
};

// What the water does to a body at (x*, v*).
template <class Real>
struct WaterPush {
  Motion<Real> acceleration;      // b
  Real stiffness, spin_stiffness; // dt/2 K S/m, and the same for the angle
};

// A block's conductance for turning about its centre is S_R = 4/3 h^2 S.
template <class T>
inline T turning_share(const BlockShape<T>& block) {
  return T(4.0 / 3.0) * block.half_side * block.half_side;
}

template <class Real, class T>
inline Ahead<Real> look_ahead(const StepConstants<T>& step, const Body<Real>& body,
                              const Motion<Real>& noise) {
  const T half = T(0.5) * step.dt, quarter = T(0.25) * step.dt;
  const Motion<Real>& v = body.motion;
  Ahead<Real> ahead;
  ahead.motion.vx = v.vx + (body.drag.vx + noise.vx) * half;
  ahead.motion.vy = v.vy + (body.drag.vy + noise.vy) * half;
  ahead.motion.omega = v.omega + (body.drag.omega + noise.omega) * half;
  ahead.pose.x = body.pose.x + (v.vx + ahead.motion.vx) * quarter;
  ahead.pose.y = body.pose.y + (v.vy + ahead.motion.vy) * quarter;
  ahead.pose.theta = body.pose.theta + (v.omega + ahead.motion.omega) * quarter;
  return ahead;
}

// Takes the body, whose v* is `ahead`, to the end of the step. Returns the angle by which it has
// turned [rad].
template <class Real, class T>
inline Real finish_step(const StepConstants<T>& step, const Motion<Real>& noise,
                        const Motion<Real>& ahead, const WaterPush<Real>& push, Body<Real>& body) {
  const T dt = step.dt, half = T(0.5) * dt;
  const Real one{T(1)};
  const Motion<Real> v = body.motion;
  const Real damping = one / (one + push.stiffness);
  const Real spin_damping = one / (one + push.spin_stiffness);
  Motion<Real> mean;
  mean.vx = ahead.vx + (push.acceleration.vx - body.drag.vx) * damping * half;
  mean.vy = ahead.vy + (push.acceleration.vy - body.drag.vy) * damping * half;
  mean.omega = ahead.omega + (push.acceleration.omega - body.drag.omega) * spin_damping * half;
  const Real turned = mean.omega * dt;
  body.pose.x = body.pose.x + mean.vx * dt;
  body.pose.y = body.pose.y + mean.vy * dt;
  body.pose.theta = wrap_angle(body.pose.theta + turned);
  body.motion.vx = mean.vx * T(2) - v.vx;
  body.motion.vy = mean.vy * T(2) - v.vy;
  body.motion.omega = mean.omega * T(2) - v.omega;
  body.drag.vx = (body.motion.vx - v.vx) * step.per_dt - noise.vx;
  body.drag.vy = (body.motion.vy - v.vy) * step.per_dt - noise.vy;
  body.drag.omega = (body.motion.omega - v.omega) * step.per_dt - noise.omega;
  return turned;
}

// To be called where a wall has touched the body.
template <class Real>
inline void forget_drag(typename Numbers<Real>::Bool where, Body<Real>& body) {
  const Real zero{typename Numbers<Real>::Scalar(0)};
  body.drag.vx = select(where, zero, body.drag.vx);
  body.drag.vy = select(where, zero, body.drag.vy);
  body.drag.omega = select(where, zero, body.drag.omega);
}

DRIFTWALK_LANES_END
