// A drag with a quadratic part, on windward strips (quadratic.hpp), and a linear one on all strips:
//
//     F = K (a max(0, s) + b) w
//
// a is a plain number, b a speed [m/s]. With a = 1 and b = 0 it is the quadratic law. Of the
// moments b adds b E[s] to the force, b E[w_t] to slip_force and b to the conductance, nothing to
// the rest.
#pragma once

#include "driftwalk/physics/laws/quadratic.hpp"

DRIFTWALK_LANES_BEGIN

template <class Real>
struct MixedDrag {
  Real quadratic; // a; the drag coefficient, where K is a world's drag_scale
  Real linear;    // b [m/s]

  static inline MixedDrag of(Real drag_coefficient, Real linear_drag) {
    return {drag_coefficient, linear_drag};
  }
  template <class Number>
  inline Number strength(Number) const {
    return Number(typename Numbers<Number>::Scalar(1));
  }

  inline Real conductance(Real closing) const {
    using T = typename Numbers<Real>::Scalar;
    const Real zero{T(0)};
    const auto wet = closing > Real(static_cast<T>(0.5 * closing_where_covered));
    return select(wet, quadratic * max(closing, zero) + linear, zero);
  }

  inline Real force(Real closing) const { return conductance(closing) * closing; }

  // Of a law in plain numbers.
  inline StripMoments moments(Eight mean, Eight slip, Eight variance, Eight cross) const {
    StripMoments m = QuadraticDrag{}.moments(mean, slip, variance, cross);
    Eight* const moments[] = {&m.force,       &m.slip_force, &m.conductance, &m.slope,
                              &m.slope_force, &m.slope_slip, &m.bend_force,  &m.bend_slip};
    for (Eight* moment : moments) {
      *moment = select(m.takes_part, quadratic * *moment, Eight(0));
    }
    if (linear != 0) {
      m.force += linear * mean;
      m.slip_force += linear * slip;
      m.conductance += linear;
      m.takes_part = Eight(0) < Eight(1);
    }
    return m;
  }
};

DRIFTWALK_LANES_END
