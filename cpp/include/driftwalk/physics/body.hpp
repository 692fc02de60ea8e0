// Where a rigid body is and how it moves: a block, or an assembly of them.
#pragma once

#include "driftwalk/math/elementary.hpp"

DRIFTWALK_LANES_BEGIN

template <class Real>
struct Pose {
  Real x, y, theta; // [m, m, rad]
};
// A velocity, or an acceleration.
template <class Real>
struct Motion {
  Real vx, vy, omega; // [m/s, m/s, rad/s]
};

template <class Real>
inline Motion<Real> operator+(const Motion<Real>& a, const Motion<Real>& b) {
  return {a.vx + b.vx, a.vy + b.vy, a.omega + b.omega};
}

// A body's axes: cosine and sine of its orientation.
template <class Real>
struct Axes {
  Real cosine, sine;
};

template <class Real>
inline Axes<Real> axes_at(Real theta) {
  Axes<Real> axes;
  sincos(bounded_angle(theta), axes.sine, axes.cosine);
  return axes;
}

DRIFTWALK_LANES_END
