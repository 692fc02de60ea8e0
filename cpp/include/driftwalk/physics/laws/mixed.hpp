// A drag with a quadratic part, on windward strips (quadratic.hpp), and a linear one on all strips:
//
//     F = K (a max(0, s) (|w|/U)^(p-2) + b) w
//
// a is a plain number, b a speed [m/s], p the power of the speed with which the first part goes, U
// the speed at which a holds. With a = 1, b = 0 and p = 2 it is the quadratic law. Of the moments,
// which are those for p = 2, b adds b E[s] to the force, b E[w_t] to slip_force and b to the
// conductance, nothing to the rest.
#pragma once

#include "driftwalk/math/elementary.hpp"
#include "driftwalk/physics/laws/quadratic.hpp"

DRIFTWALK_LANES_BEGIN

template <class Real>
struct MixedDrag {
  using Scalar = typename Numbers<Real>::Scalar;
  Real quadratic;             // a; the drag coefficient, where K is a world's drag_scale
  Real linear;                // b [m/s]
  Real exponent{Scalar(0)};   // p/2 - 1, of |w|^2; the same in all lanes
  Real per_square{Scalar(0)}; // 1/U^2
  bool bent = false;          // whether p is not 2

  static inline MixedDrag of(Real drag_coefficient, const DragShape<Scalar>& shape) {
    return {drag_coefficient, Real(shape.linear), Real(shape.exponent),
            Real(shape.per_square_speed), shape.exponent != 0};
  }
  template <class Number>
  inline Number strength(Number) const {
    return Number(typename Numbers<Number>::Scalar(1));
  }

  inline Real conductance(Real closing, Real slip) const {
    Real windward = max(closing, Real(Scalar(0)));
    if (bent) {
      // At rest in the water it has no limit for p < 1; the floor is 1 um/s at U = 3 cm/s.
      const Real square = max((closing * closing + slip * slip) * per_square, Real(Scalar(1e-9)));
      windward = windward * exp(exponent * log(square));
    }
    const auto wet = closing > Real(static_cast<Scalar>(0.5 * closing_where_covered));
    return select(wet, quadratic * windward + linear, Real(Scalar(0)));
  }

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
