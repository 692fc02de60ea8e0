// The paper's drag (Eq. 2): quadratic, on windward strips only.
//
//     F = K max(0, s) w,   K = 1/2 rho C_d (a/N) d
//
// With s+ = max(0, s), s ~ N(m, tau^2), c = cov(s, w_t), and phi, Phi at m / tau:
//     E[s+]        = m Phi + tau phi
//     E[s+^2]      = (m^2 + tau^2) Phi + m tau phi
//     E[s+ w_t]    = w_t E[s+] + c Phi
//     E[w_t; s>0]  = w_t Phi + c phi / tau
#pragma once

#include "driftwalk/math/normal_law.hpp"
#include "driftwalk/physics/drag_law.hpp"

DRIFTWALK_LANES_BEGIN

struct QuadraticDrag {
  // The law of a world, and K over the world's drag_scale.
  template <class Real, class T>
  static inline QuadraticDrag of(Real, const DragShape<T>&) {
    return {};
  }
  template <class Real>
  inline Real strength(Real drag_coefficient) const {
    return drag_coefficient;
  }

  template <class Real>
  inline Real conductance(Real closing) const {
    return max(closing, Real(typename Numbers<Real>::Scalar(0)));
  }

  template <class Real>
  inline Real force(Real closing) const {
    const Real windward = conductance(closing);
    return windward * windward;
  }

  inline StripMoments moments(Eight mean, Eight slip, Eight variance, Eight cross) const {
    // A block that is known exactly has tau = 0; the floor stands for it, at 10 nm/s.
    const Eight tau = square_root(at_least(variance, 1e-16));
    const Eight z = mean / tau;
    const NormalLaw law = normal_law(z);
    StripMoments m;
    m.conductance = m.slope_force = mean * law.probability + tau * law.density;
    m.force = (mean * mean + variance) * law.probability + mean * (tau * law.density);
    m.slip_force = slip * m.conductance + cross * law.probability;
    m.slope = law.probability;
    m.slope_slip = slip * law.probability + cross * law.density / tau;
    m.bend_force = 2 * law.probability;
    m.bend_slip = law.density / tau * (slip - cross * mean / (tau * tau));
    m.takes_part = z > -normal_reach;
    return m;
  }
};

DRIFTWALK_LANES_END
