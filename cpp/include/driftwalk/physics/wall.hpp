// Impulses between the corners of a block and the wall of a convex arena.
//
// Two corners can touch a circle, or one straight edge, at a time: the deepest, and the one that
// flips the smaller body-frame component of the normal. Their normal impulses are solved together
// (a flat face bounces without spinning up), with restitution e above the bounce speed and none
// below; Coulomb friction follows, then a second pass without restitution. Every impulse either
// reflects a closing speed with e <= 1 or opposes a sliding speed without reversing it, so the
// kinetic energy never grows. Penetration is removed by moving the block, velocities unchanged.
//
// Impulses are per unit mass; `per_inertia` is mass / moment of inertia [1/m^2].
#pragma once

#include "driftwalk/physics/body.hpp"
#include "driftwalk/simulate/prepared.hpp"

DRIFTWALK_LANES_BEGIN

inline constexpr double root_two = 1.41421356237309515;

template <class Real>
struct Contact {
  Real rx, ry; // corner from the centre of mass [m]
  Real nx, ny; // outward normal there
  Real depth;  // penetration [m], negative when clear
};

// How easily an impulse at the corner changes the speed there: 1 / (1 + lever^2 m/I).
template <class Real>
struct Response {
  Real normal, tangent;
};

template <class Real>
inline Real closing_speed(const Contact<Real>& c, const Motion<Real>& m) {
  return (m.vx - m.omega * c.ry) * c.nx + (m.vy + m.omega * c.rx) * c.ny;
}
template <class Real>
inline Real normal_lever(const Contact<Real>& c) {
  return c.rx * c.ny - c.ry * c.nx;
}
template <class Real>
inline Real tangent_lever(const Contact<Real>& c) {
  return c.rx * c.nx + c.ry * c.ny;
}

// Apply the inward normal impulse `push` and the tangential impulse `drag` (along (-ny, nx)).
template <class Real>
inline void apply_impulse(const Contact<Real>& c, Real push, Real drag, Real per_inertia,
                          Motion<Real>& m) {
  m.vx = m.vx - push * c.nx - drag * c.ny;
  m.vy = m.vy - push * c.ny + drag * c.nx;
  m.omega = m.omega + (drag * tangent_lever(c) - push * normal_lever(c)) * per_inertia;
}

template <class Real>
inline Response<Real> response(const Contact<Real>& c, Real per_inertia) {
  using T = typename Numbers<Real>::Scalar;
  const Real one{T(1)}, n = normal_lever(c), t = tangent_lever(c);
  return {one / (one + n * n * per_inertia), one / (one + t * t * per_inertia)};
}

// Coulomb friction that belongs to the normal impulse `push`.
template <class Real, class T>
inline void apply_friction(const Contact<Real>& c, const Response<Real>& r, Real push, T friction,
                           Real per_inertia, Motion<Real>& m) {
  if (friction == T(0)) {
    return;
  }
  const Real sliding = (m.vy + m.omega * c.rx) * c.nx - (m.vx - m.omega * c.ry) * c.ny;
  const Real stop = -sliding * r.tangent;
  const Real limit = push * friction;
  apply_impulse(c, Real(T(0)), max(min(stop, limit), -limit), per_inertia, m);
}

// The change of the closing speed that a bounce asks for: none where the corner does not hit.
template <class Real, class T>
inline Real bounce_of(const Contact<Real>& c, const WallView<T>& wall, const Motion<Real>& m) {
  const Real zero{T(0)}, one{T(1)};
  const Real speed = closing_speed(c, m);
  const auto hit = (c.depth > zero) & (speed > zero);
  const Real restitution = select(speed > Real(wall.bounce_speed), Real(wall.restitution), zero);
  return select(hit, speed * (one + restitution), zero);
}

// What the first pass left closing is stopped, without restitution.
template <class Real, class T>
inline void stop_closing(const Contact<Real>& c, const Response<Real>& r, const WallView<T>& wall,
                         Real per_inertia, Motion<Real>& m) {
  const Real zero{T(0)};
  const Real left = select(c.depth > zero, max(closing_speed(c, m), zero), zero);
  if (any(left > zero)) {
    const Real push = left * r.normal;
    apply_impulse(c, push, zero, per_inertia, m);
    apply_friction(c, r, push, wall.friction, per_inertia, m);
  }
}

template <class Real, class T>
inline void resolve_contact(const Contact<Real>& c, const WallView<T>& wall, Real per_inertia,
                            Motion<Real>& m) {
  const Response<Real> r = response(c, per_inertia);
  const Real push = bounce_of(c, wall, m) * r.normal;
  apply_impulse(c, push, Real(T(0)), per_inertia, m);
  apply_friction(c, r, push, wall.friction, per_inertia, m);
  stop_closing(c, r, wall, per_inertia, m);
}

// With one corner only it is what resolve_contact does, bit for bit.
template <class Real, class T>
inline void resolve_contacts(const Contact<Real>& a, const Contact<Real>& b,
                             const WallView<T>& wall, Real per_inertia, Motion<Real>& m) {
  const Real zero{T(0)}, one{T(1)};
  if (!any(b.depth > zero)) {
    resolve_contact(a, wall, per_inertia, m);
    return;
  }
  const Real want_a = bounce_of(a, wall, m), want_b = bounce_of(b, wall, m);
  const Real lever_a = normal_lever(a), lever_b = normal_lever(b);
  const Real aa = one + lever_a * lever_a * per_inertia;
  const Real bb = one + lever_b * lever_b * per_inertia;
  const Real ab = (a.nx * b.nx + a.ny * b.ny) + lever_a * lever_b * per_inertia;
  const Real scale = one / (aa * bb - ab * ab);
  const Real joint_a = (bb * want_a - ab * want_b) * scale;
  const Real joint_b = (aa * want_b - ab * want_a) * scale;
  const Response<Real> response_a = response(a, per_inertia);
  const Response<Real> response_b = response(b, per_inertia);
  const auto joint = (want_a > zero) & (want_b > zero) & (joint_a > zero) & (joint_b > zero);
  // With one corner only, or where both together would pull: the faster corner alone.
  const auto a_alone = want_a * bb >= want_b * aa;
  const Real push_a = select(joint, joint_a, select(a_alone, want_a * response_a.normal, zero));
  const Real push_b = select(joint, joint_b, select(a_alone, zero, want_b * response_b.normal));
  apply_impulse(a, push_a, zero, per_inertia, m);
  apply_impulse(b, push_b, zero, per_inertia, m);
  apply_friction(a, response_a, push_a, wall.friction, per_inertia, m);
  apply_friction(b, response_b, push_b, wall.friction, per_inertia, m);
  stop_closing(a, response_a, wall, per_inertia, m);
  stop_closing(b, response_b, wall, per_inertia, m);
}

// A block's centre from the centre of mass of the body that it is part of [m].
template <class Real>
struct Arm {
  Real x, y;
};

// A block that is a body by itself: its arm is zero, and nothing is added.
struct NoArm {};
template <class Real>
inline Real arm_x(Real x, const NoArm&) {
  return x;
}
template <class Real>
inline Real arm_y(Real y, const NoArm&) {
  return y;
}
template <class Real>
inline Real arm_x(Real x, const Arm<Real>& arm) {
  return x + arm.x;
}
template <class Real>
inline Real arm_y(Real y, const Arm<Real>& arm) {
  return y + arm.y;
}

// A round block: it touches a wall at one point.
template <class T>
struct Disc {
  T radius;
};

// A rectangle, of which each block of an assembly has axes of its own.
template <class T>
struct Box {
  T half_length, half_width, reach;
};

// How far a block reaches from its centre, from half its side; of others a little more. Rounding
// must not decide whether a lane that touches is looked at: that would depend on its neighbours.
inline constexpr double reach_margin = 1.001;
template <class T>
inline T reach_of(T h) {
  return h * T(root_two);
}
template <class T>
inline T reach_of(const Disc<T>& disc) {
  return disc.radius * T(reach_margin);
}
template <class T>
inline T reach_of(const Box<T>& box) {
  return box.reach * T(reach_margin);
}

// The corner (s1, s2) of the body's frame, and that across its first or its second axis; from the
// centre of mass.
template <class Real, class Lever>
inline void put_corners(Real s1, Real s2, typename Numbers<Real>::Bool flip_first,
                        const Axes<Real>& axes, const Lever& arm, Contact<Real>& first,
                        Contact<Real>& second) {
  const Real f1 = select(flip_first, -s1, s1), f2 = select(flip_first, s2, -s2);
  first.rx = arm_x(s1 * axes.cosine - s2 * axes.sine, arm);
  first.ry = arm_y(s1 * axes.sine + s2 * axes.cosine, arm);
  second.rx = arm_x(f1 * axes.cosine - f2 * axes.sine, arm);
  second.ry = arm_y(f1 * axes.sine + f2 * axes.cosine, arm);
}

// The two corners that can touch, given the direction (nx, ny) of the wall seen from the block's
// centre; from the centre of mass.
template <class Real, class T, class Lever>
inline void leading_corners(Real nx, Real ny, T h, const Axes<Real>& axes, const Lever& arm,
                            Contact<Real>& first, Contact<Real>& second) {
  const Real p1 = nx * axes.cosine + ny * axes.sine;
  const Real p2 = ny * axes.cosine - nx * axes.sine;
  const Real s1 = copy_sign(Real(h), p1), s2 = copy_sign(Real(h), p2);
  put_corners(s1, s2, abs(p1) < abs(p2), axes, arm, first, second);
}
template <class Real, class T, class Lever>
inline void leading_corners(Real nx, Real ny, const Box<T>& box, const Axes<Real>& axes,
                            const Lever& arm, Contact<Real>& first, Contact<Real>& second) {
  const Real p1 = nx * axes.cosine + ny * axes.sine;
  const Real p2 = ny * axes.cosine - nx * axes.sine;
  const Real s1 = copy_sign(Real(box.half_length), p1), s2 = copy_sign(Real(box.half_width), p2);
  put_corners(s1, s2, p1 * s1 < p2 * s2, axes, arm, first, second);
}

// Of a disc the one point, and the one across, which is clear of the wall.
template <class Real, class T, class Lever>
inline void leading_corners(Real nx, Real ny, const Disc<T>& disc, const Axes<Real>&,
                            const Lever& arm, Contact<Real>& first, Contact<Real>& second) {
  const Real scale = Real(disc.radius) / max(sqrt(nx * nx + ny * ny), Real(T(1e-9)));
  first.rx = arm_x(nx * scale, arm);
  first.ry = arm_y(ny * scale, arm);
  second.rx = arm_x(-nx * scale, arm);
  second.ry = arm_y(-ny * scale, arm);
}

template <class Real, class T>
inline void measure_circle(Contact<Real>& c, T radius, Real x, Real y) {
  const Real px = x + c.rx, py = y + c.ry;
  const Real distance = sqrt(px * px + py * py);
  const Real per_distance = Real(T(1)) / max(distance, Real(T(1e-9)));
  c.nx = px * per_distance;
  c.ny = py * per_distance;
  c.depth = distance - radius;
}

template <class Real, class T>
inline void measure_edge(Contact<Real>& c, const PreparedEdge<T>& edge, Real x, Real y) {
  c.nx = Real(edge.normal_x);
  c.ny = Real(edge.normal_y);
  c.depth = ((x + c.rx) * edge.normal_x + (y + c.ry) * edge.normal_y) - edge.distance;
}

template <class Real, class T>
inline void push_out(const Contact<Real>& c, Pose<Real>& pose) {
  const Real shift = max(c.depth, Real(T(0)));
  pose.x = pose.x - c.nx * shift;
  pose.y = pose.y - c.ny * shift;
}

// Between edges that meet at less than a right angle, leaving one can mean entering the next: go
// round until all are clear. Lanes that are clear stay as they are, bit for bit.
template <class Real, class T, class Half, class Lever>
inline void push_inside_edges(const WallView<T>& wall, Half h, const Axes<Real>& axes,
                              const Lever& arm, Pose<Real>& pose) {
  constexpr int most_rounds = 16;
  Contact<Real> first, second;
  for (int round = 0; round < most_rounds; ++round) {
    bool moved = false;
    for (int e = 0; e < wall.edge_count; ++e) {
      const PreparedEdge<T>& edge = wall.edges[e];
      leading_corners(Real(edge.normal_x), Real(edge.normal_y), h, axes, arm, first, second);
      measure_edge(first, edge, pose.x, pose.y);
      moved = moved || any(first.depth > Real(T(0)));
      push_out<Real, T>(first, pose);
    }
    if (!moved) {
      return;
    }
  }
}

// Of the circle, both corners; returns where one was farther outside than `tolerance`.
template <class Real, class T, class Half, class Lever>
inline auto push_inside_circle(const WallView<T>& wall, Half h, const Axes<Real>& axes,
                               const Lever& arm, T tolerance, Pose<Real>& pose) ->
    typename Numbers<Real>::Bool {
  Contact<Real> first, second;
  leading_corners(arm_x(pose.x, arm), arm_y(pose.y, arm), h, axes, arm, first, second);
  measure_circle(first, wall.radius, pose.x, pose.y);
  const auto outside = first.depth > Real(tolerance);
  if (any(outside)) {
    push_out<Real, T>(first, pose);
    measure_circle(second, wall.radius, pose.x, pose.y);
    push_out<Real, T>(second, pose);
  }
  return outside;
}

// The corners of a block that can touch a circle, and where the first does.
template <class Real>
struct CircleContacts {
  Contact<Real> first, second;
  typename Numbers<Real>::Bool touched;
};

// The second corner is measured later, where the first touches. `axes_of(angle)` gives the block's
// axes.
template <class Real, class T, class Half, class Lever, class AxesOf>
inline void find_circle(const WallView<T>& wall, Half h, const Lever& arm, const AxesOf& axes_of,
                        const Pose<Real>& pose, CircleContacts<Real>& found) {
  const T inner = max(wall.radius - reach_of(h), T(0));
  const Real x = arm_x(pose.x, arm), y = arm_y(pose.y, arm);
  found.touched = x * x + y * y > Real(inner * inner);
  if (any(found.touched)) {
    leading_corners(x, y, h, axes_of(pose.theta), arm, found.first, found.second);
    measure_circle(found.first, wall.radius, pose.x, pose.y);
    found.touched = found.first.depth > Real(T(0));
  }
}

// Bounces off the circle, where it touches.
template <class Real, class T>
inline void leave_circle(const WallView<T>& wall, Real per_inertia, CircleContacts<Real>& found,
                         Pose<Real>& pose, Motion<Real>& motion) {
  if (!any(found.touched)) {
    return;
  }
  measure_circle(found.second, wall.radius, pose.x, pose.y);
  resolve_contacts(found.first, found.second, wall, per_inertia, motion);
  push_out<Real, T>(found.first, pose);
  // On a side as long as the tank is wide, the first corner's way out can lead the second outwards.
  measure_circle(found.second, wall.radius, pose.x, pose.y);
  push_out<Real, T>(found.second, pose);
}

// Returns where an edge of a polygon touched the block.
template <class Real, class T, class Half, class Lever, class AxesOf>
inline auto meet_edges(const WallView<T>& wall, Half h, Real per_inertia, const Lever& arm,
                       const AxesOf& axes_of, Pose<Real>& pose, Motion<Real>& motion) ->
    typename Numbers<Real>::Bool {
  const Real zero{T(0)};
  const T reach = reach_of(h);
  Contact<Real> first, second;
  auto touched = zero > zero;
  for (int e = 0; e < wall.edge_count; ++e) {
    const PreparedEdge<T>& edge = wall.edges[e];
    const Real along = arm_x(pose.x, arm) * edge.normal_x + arm_y(pose.y, arm) * edge.normal_y;
    if (!any(along > Real(edge.distance - reach))) {
      continue;
    }
    const Axes<Real> axes = axes_of(pose.theta);
    leading_corners(Real(edge.normal_x), Real(edge.normal_y), h, axes, arm, first, second);
    measure_edge(first, edge, pose.x, pose.y);
    if (!any(first.depth > zero)) {
      continue;
    }
    measure_edge(second, edge, pose.x, pose.y);
    touched = touched | (first.depth > zero);
    resolve_contacts(first, second, wall, per_inertia, motion);
    push_out<Real, T>(first, pose);
  }
  if (any(touched)) {
    push_inside_edges(wall, h, axes_of(pose.theta), arm, pose);
  }
  return touched;
}

// Returns where a wall touched the block. `pose` and `motion` are those of the body that the block
// is part of, `per_inertia` its mass / moment of inertia; `axes_of(angle)` gives the block's axes.
template <class Real, class T, class Half, class Lever, class AxesOf>
inline auto meet_wall(const WallView<T>& wall, Half h, Real per_inertia, const Lever& arm,
                      const AxesOf& axes_of, Pose<Real>& pose, Motion<Real>& motion) ->
    typename Numbers<Real>::Bool {
  if (wall.radius > T(0)) {
    CircleContacts<Real> found;
    find_circle(wall, h, arm, axes_of, pose, found);
    leave_circle(wall, per_inertia, found, pose, motion);
    return found.touched;
  }
  return meet_edges(wall, h, per_inertia, arm, axes_of, pose, motion);
}

// The same for a block alone.
template <class Real, class T>
inline auto meet_wall(const WallView<T>& wall, T h, Real per_inertia, Pose<Real>& pose,
                      Motion<Real>& motion) -> typename Numbers<Real>::Bool {
  return meet_wall(wall, h, per_inertia, NoArm{}, axes_at<Real>, pose, motion);
}

DRIFTWALK_LANES_END
