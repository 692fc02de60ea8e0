// What a drag law is: the force of the water on one strip of a side face. The kernels take it as a
// template argument: the step of a block, that of assemblies, and the filter of the likelihood.
//
// A strip with outward normal n, and w the velocity of the water relative to it, has the closing
// speed s = -n.w and feels
//     F = K g(s) w,   so  -n.F = K f(s)  with  f(s) = g(s) s
// K is the same for all strips of a world: its drag_scale times the law's strength at the drag
// coefficient. The law is g, the conductance, and f, the force. It may have numbers of its own, one
// per lane.
//
// The filter knows (s, w_t) as normal, w_t = t.w the slip along the face. It needs the means of F
// and of its first and second derivatives by s and w_t: the moments.
#pragma once

#include "driftwalk/math/doubles.hpp"
#include "driftwalk/physics/drag_shape.hpp"

#include <concepts>

DRIFTWALK_LANES_BEGIN

// The closing speed of a strip that no water reaches [m/s]: no law gives it a force.
inline constexpr double closing_where_covered = -1e9;

// Means over (s, w_t) for eight strips; g' and g'' are derivatives by s.
struct StripMoments {
  Eight force;       // E[f]
  Eight slip_force;  // E[g w_t]
  Eight conductance; // E[g]
  Eight slope;       // E[g']
  Eight slope_force; // E[g' s]
  Eight slope_slip;  // E[g' w_t]
  Eight bend_force;  // E[f'']
  Eight bend_slip;   // E[g'' w_t]
  Eight::Mask takes_part;
};

// A law whose g needs the slip as well.
template <class Law, class Real>
concept DragLawBySpeed = requires(const Law& law, Real closing, Real slip) {
  { law.conductance(closing, slip) } -> std::same_as<Real>;
};

template <class Law, class Real>
concept DragLaw = DragLawBySpeed<Law, Real> || requires(const Law& law, Real closing) {
  { law.conductance(closing) } -> std::same_as<Real>;
  { law.force(closing) } -> std::same_as<Real>;
};

// `mean` and `slip` are the means of s and w_t, `variance` is that of s, `cross` their covariance.
template <class Law>
concept DragLawWithMoments =
    requires(const Law& law, Eight mean, Eight slip, Eight variance, Eight cross) {
      { law.moments(mean, slip, variance, cross) } -> std::same_as<StripMoments>;
    };

DRIFTWALK_LANES_END
