// What the water and the wall do to a rigid body that is no single square block: a disc, a
// rectangle, a polyomino.
//
// Its side is made of panels, each a strip with a place r and a normal n of its own. The law of the
// strips (physics/drag_law.hpp) holds for each:
//     F_k = weight_k K g(s_k) w_k,   w_k = u(x + r_k) - v - omega J r_k,   s_k = -n_k.w_k
// The panels of a disc do not turn with it, and its spin adds nothing to the force: with it the law
// would push a spinning disc sideways, the other way than water does. In a uniform flow the sum
// over a disc is that of form drag, 1/2 rho C_d 2R d |w| w. Its spin goes to that of the water past
// it:
//     torque = sum of weight_k K g(s_k) R (t_k.w_k - omega R)
#pragma once

#include "driftwalk/flow/bilinear.hpp"
#include "driftwalk/physics/drag.hpp"
#include "driftwalk/physics/wall.hpp"

DRIFTWALK_LANES_BEGIN

// A place or a direction of the body's frame, turned by its axes.
template <class Real, class T>
inline Arm<Real> turned(T x, T y, const Axes<Real>& axes) {
  return {axes.cosine * x - axes.sine * y, axes.sine * x + axes.cosine * y};
}

// The flow, or the water's acceleration, at a place on the table or at its edge, in units of the
// table.
template <class Real, class T>
inline Arm<Real> flow_at(const FlowView<T>& flow, Real x, Real y) {
  const Real zero{T(0)};
  FlowCursor<Real> cursor(flow, (x - flow.origin_x) * flow.per_spacing_x,
                          (y - flow.origin_y) * flow.per_spacing_y, zero, zero);
  Arm<Real> found;
  cursor.read(found.x, found.y);
  return found;
}

template <class Real, class T, DragLaw<Real> Law>
inline DragSums<Real> panel_sums(const Law& law, const BodyShape<T>& shape, const FlowView<T>& flow,
                                 Real x, Real y, const Axes<Real>& axes,
                                 const Motion<Real>& motion) {
  const Real zero{T(0)};
  const bool round = shape.disc_radius > T(0);
  const Axes<Real> still{Real(T(1)), zero};
  const Axes<Real>& used = round ? still : axes;
  const Real centre_x = clamp_to(x, flow.low_x, flow.high_x);
  const Real centre_y = clamp_to(y, flow.low_y, flow.high_y);
  const Real spin = round ? zero : motion.omega;
  DragSums<Real> sums{zero, zero, zero, zero};
  for (int k = 0; k < shape.panel_count; ++k) {
    const Panel<T>& panel = shape.panels[k];
    const Arm<Real> n = turned(panel.nx, panel.ny, used), r = turned(panel.x, panel.y, used);
    const Arm<Real> water = flow_at(flow, centre_x + r.x, centre_y + r.y);
    const Real wx = water.x * flow.unit - motion.vx + spin * r.y;
    const Real wy = water.y * flow.unit - motion.vy - spin * r.x;
    const Real closing = -(n.x * wx + n.y * wy), slip = n.x * wy - n.y * wx;
    Real g;
    if constexpr (DragLawBySpeed<Law, Real>) {
      g = law.conductance(closing, slip) * panel.weight;
    } else {
      g = law.conductance(closing) * panel.weight;
    }
    sums.force_x = sums.force_x + g * wx;
    sums.force_y = sums.force_y + g * wy;
    sums.torque =
        sums.torque + g * (round ? (slip - motion.omega * shape.disc_radius) * shape.disc_radius
                                 : r.x * wy - r.y * wx);
    sums.conductance = sums.conductance + g;
  }
  return sums;
}

// As water_acceleration of a block: the mean of Du/Dt over points of the body's area, and its mean
// moment about the centre over their mean squared distance.
template <class Real, class T>
inline Motion<Real> water_acceleration(const WaterView<T>& water, const BodyShape<T>& shape,
                                       const Axes<Real>& axes, Real x, Real y) {
  FlowView<T> nodes = water.nodes;
  const Real zero{T(0)};
  const Real centre_x = clamp_to(x, nodes.low_x, nodes.high_x);
  const Real centre_y = clamp_to(y, nodes.low_y, nodes.high_y);
  Motion<Real> sums{zero, zero, zero};
  for (int k = 0; k < water.count; ++k) {
    Real part{water.part};
    if (water.lanes != nullptr) {
      nodes.lanes = &water.lanes->table[k];
      load_lanes(water.lanes->part[k], part);
    }
    for (int j = 0; j < shape.point_count; ++j) {
      const AreaPoint<T>& point = shape.points[j];
      const Arm<Real> r = turned(point.x, point.y, axes);
      const Arm<Real> at = flow_at(nodes, centre_x + r.x, centre_y + r.y);
      const Real share = part * point.share;
      sums.vx = sums.vx + at.x * share;
      sums.vy = sums.vy + at.y * share;
      sums.omega = sums.omega + (r.x * at.y - r.y * at.x) * share;
    }
  }
  const T mean = nodes.unit;
  return {sums.vx * (mean * water.push), sums.vy * (mean * water.push),
          sums.omega * (mean * shape.per_radius_square * water.spin)};
}

template <class Real>
inline Contact<Real> select(typename Numbers<Real>::Bool where, const Contact<Real>& yes,
                            const Contact<Real>& no) {
  return {select(where, yes.rx, no.rx), select(where, yes.ry, no.ry), select(where, yes.nx, no.nx),
          select(where, yes.ny, no.ny), select(where, yes.depth, no.depth)};
}

// The two corners that are deepest in the wall; of a disc, which lies in the direction (nx, ny) of
// the wall, its one point. `measure(contact)` says where a corner is.
template <class Real, class T, class Measure>
inline void deepest_corners(const BodyShape<T>& shape, const Axes<Real>& axes, Real nx, Real ny,
                            const Measure& measure, Contact<Real>& first, Contact<Real>& second) {
  const Real zero{T(0)}, clear{T(-1e9)};
  first = second = {zero, zero, zero, zero, clear};
  if (shape.disc_radius > T(0)) {
    first.rx = nx * shape.disc_radius;
    first.ry = ny * shape.disc_radius;
    measure(first);
    return;
  }
  for (int k = 0; k < shape.corner_count; ++k) {
    const Arm<Real> r = turned(shape.corners[k].x, shape.corners[k].y, axes);
    Contact<Real> corner{r.x, r.y, zero, zero, clear};
    measure(corner);
    const auto deepest = corner.depth > first.depth;
    const auto deeper = corner.depth > second.depth;
    second = select<Real>(deepest, first, select<Real>(deeper, corner, second));
    first = select<Real>(deepest, corner, first);
  }
}

// Off one piece of the wall. Returns where it touched the body.
template <class Real, class T, class Measure>
inline auto leave_wall(const WallView<T>& wall, const BodyShape<T>& shape, Real per_inertia,
                       Real nx, Real ny, const Measure& measure, Pose<Real>& pose,
                       Motion<Real>& motion) -> typename Numbers<Real>::Bool {
  const Real zero{T(0)};
  Contact<Real> first, second;
  deepest_corners(shape, axes_at(pose.theta), nx, ny, measure, first, second);
  const auto touched = first.depth > zero;
  if (any(touched)) {
    resolve_contacts(first, second, wall, per_inertia, motion);
    push_out<Real, T>(first, pose);
    measure(second);
    push_out<Real, T>(second, pose);
  }
  return touched;
}

// Returns where a wall touched the body.
template <class Real, class T>
inline auto meet_wall(const WallView<T>& wall, const BodyShape<T>& shape, Real per_inertia,
                      Pose<Real>& pose, Motion<Real>& motion) -> typename Numbers<Real>::Bool {
  const T reach = shape.reach * T(reach_margin);
  if (wall.radius > T(0)) {
    const T inner = max(wall.radius - reach, T(0));
    const Real square = pose.x * pose.x + pose.y * pose.y;
    const auto near = square > Real(inner * inner);
    if (!any(near)) {
      return near;
    }
    const Real per_distance = Real(T(1)) / max(sqrt(square), Real(T(1e-9)));
    const auto measure = [&](Contact<Real>& c) { measure_circle(c, wall.radius, pose.x, pose.y); };
    return leave_wall(wall, shape, per_inertia, pose.x * per_distance, pose.y * per_distance,
                      measure, pose, motion);
  }
  // Leaving one edge can mean entering the next (push_inside_edges).
  constexpr int most_rounds = 16;
  auto touched = pose.x != pose.x;
  for (int round = 0; round < most_rounds; ++round) {
    auto now = pose.x != pose.x;
    for (int e = 0; e < wall.edge_count; ++e) {
      const PreparedEdge<T>& edge = wall.edges[e];
      const Real along = pose.x * edge.normal_x + pose.y * edge.normal_y;
      if (any(along > Real(edge.distance - reach))) {
        const auto measure = [&](Contact<Real>& c) { measure_edge(c, edge, pose.x, pose.y); };
        now = now | leave_wall(wall, shape, per_inertia, Real(edge.normal_x), Real(edge.normal_y),
                               measure, pose, motion);
      }
    }
    touched = touched | now;
    if (!any(now)) {
      break;
    }
  }
  return touched;
}

DRIFTWALK_LANES_END
