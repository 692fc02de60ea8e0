// Which worlds of a pack have blocks that touch or may latch: found for all lanes at once, settled
// lane by lane (scene.hpp).
#pragma once

#include "driftwalk/assembly/advance.hpp"

DRIFTWALK_LANES_BEGIN

template <class T>
struct NearRules {
  T half_side;
  T half_width; // of rectangles, 0: squares or discs
  bool round;
  T reach;          // no pair farther apart than this touches or latches [m]
  bool connectors;  // whether faces latch at a distance
  T connector_sine; // of the largest angle between two faces that latch
  T connector_gap;  // square of the largest distance between their centres [m^2]

  explicit NearRules(const AssemblyRules& rules)
      : half_side(static_cast<T>(rules.side / 2)), half_width(static_cast<T>(rules.width / 2)),
        round(rules.round), reach(reach_of_pair(rules)),
        connectors(rules.latching == Latching::connector), connector_sine(1), connector_gap(0) {
    if (!connectors) {
      return;
    }
    // A little beyond, so that rounding loses no pair: settle decides in double precision.
    const T distance = static_cast<T>(rules.connector_distance + 1e-6);
    reach = max(reach, static_cast<T>(rules.side) + distance);
    const double cosine = rules.connector_cosine;
    const bool faces_each_other = cosine > 0.71; // else a face can latch with any of the other's
    connector_gap = faces_each_other ? distance * distance : T(1e30);
    if (faces_each_other) {
      connector_sine = static_cast<T>(__builtin_sqrt(1 - cosine * cosine) + 1e-5);
    }
  }

private:
  static T reach_of_pair(const AssemblyRules& rules) {
    if (rules.width > 0) {
      return static_cast<T>(__builtin_sqrt(rules.side * rules.side + rules.width * rules.width) +
                            1e-7);
    }
    return static_cast<T>(rules.round ? rules.side + 1e-7 : rules.side * 1.4142135623730951);
  }
};

// Whether two rectangles overlap, by their four axes.
template <class Real, class T>
inline auto boxes_meet(const NearRules<T>& rules, Real dx, Real dy, const Axes<Real>& a,
                       const Axes<Real>& b) -> typename Numbers<Real>::Bool {
  const T length = rules.half_side, width = rules.half_width;
  const Real same = abs(a.cosine * b.cosine + a.sine * b.sine);
  const Real turned = abs(a.cosine * b.sine - a.sine * b.cosine);
  const Real along = same * length + turned * width + Real(length);
  const Real across = turned * length + same * width + Real(width);
  const Real gap_along =
      max(abs(dx * a.cosine + dy * a.sine), abs(dx * b.cosine + dy * b.sine)) - along;
  const Real gap_across =
      max(abs(dy * a.cosine - dx * a.sine), abs(dy * b.cosine - dx * b.sine)) - across;
  return max(gap_along, gap_across) < Real(T(1e-7));
}

// The axes of a block that may meet another: of a rectangle its own.
template <class Real, class T>
inline Axes<Real> near_axes(const NearRules<T>& rules, const Member<Real>& m) {
  return rules.half_width > T(0) ? turned_axes(m.axes, m.turn) : m.axes;
}

// Whether two blocks overlap or, with connectors, may have two faces within tolerance of each
// other. (dx, dy) leads from the first to the second.
template <class Real, class T>
inline auto may_meet(const NearRules<T>& rules, Real dx, Real dy, const Axes<Real>& a,
                     const Axes<Real>& b) -> typename Numbers<Real>::Bool {
  if (rules.round) {
    return dx * dx + dy * dy < Real(rules.reach * rules.reach);
  }
  if (rules.half_width > T(0)) {
    return boxes_meet(rules, dx, dy, a, b);
  }
  const T h = rules.half_side;
  const Real across_a = abs(dx * a.cosine + dy * a.sine);
  const Real up_a = abs(dy * a.cosine - dx * a.sine);
  const Real across_b = abs(dx * b.cosine + dy * b.sine);
  const Real up_b = abs(dy * b.cosine - dx * b.sine);
  const Real same = abs(a.cosine * b.cosine + a.sine * b.sine);
  const Real turned = abs(a.cosine * b.sine - a.sine * b.cosine);
  const Real extent = (same + turned) * h + h;
  // A little more than touching, so that rounding hides no contact from settle.
  auto meets = max(max(across_a, up_a), max(across_b, up_b)) < extent + Real(T(1e-7));
  if (rules.connectors) {
    const Real along = max(same, turned), askew = min(same, turned);
    const Real gap = max(across_a, up_a) - (along * h + h);
    const Real offset = max(min(across_a, up_a) - askew * h, Real(T(0)));
    meets = meets | ((askew <= Real(rules.connector_sine)) &
                     (gap * gap + offset * offset <= Real(rules.connector_gap)));
  }
  return meets;
}

template <class Real, class T>
inline auto lanes_to_settle(const NearRules<T>& rules, const Member<Real>* members, int blocks) ->
    typename Numbers<Real>::Bool {
  auto unsettled = Real(T(0)) > Real(T(0));
  const Real reach{rules.reach * rules.reach};
  for (int a = 0; a < blocks; ++a) {
    for (int b = a + 1; b < blocks; ++b) {
      const Real dx = members[b].x - members[a].x, dy = members[b].y - members[a].y;
      const auto near = (dx * dx + dy * dy < reach) & !equal(members[a].root, members[b].root);
      if (any(near)) {
        unsettled = unsettled | (near & may_meet(rules, dx, dy, near_axes(rules, members[a]),
                                                 near_axes(rules, members[b])));
      }
    }
  }
  return unsettled;
}

DRIFTWALK_LANES_END
