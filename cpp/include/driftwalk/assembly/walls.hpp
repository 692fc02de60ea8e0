// The wall and the assemblies of a pack of worlds: every block's corners, on its assembly's motion.
#pragma once

#include "driftwalk/assembly/advance.hpp"

DRIFTWALK_LANES_BEGIN

// Gives the other members of a block's assembly, in one lane, what the wall did to its copy.
template <class Real>
inline void spread(Member<Real>* members, int blocks, int block, int lane) {
  Member<Real>& from = members[block];
  const Int32 root = get(from.root, lane);
  for (int b = root; b < blocks; ++b) {
    Member<Real>& to = members[b];
    if (get(to.root, lane) != root) {
      continue;
    }
    put(to.pose.x, lane, get(from.pose.x, lane));
    put(to.pose.y, lane, get(from.pose.y, lane));
    put(to.motion.vx, lane, get(from.motion.vx, lane));
    put(to.motion.vy, lane, get(from.motion.vy, lane));
    put(to.motion.omega, lane, get(from.motion.omega, lane));
    put_rest(to.drag, lane);
  }
}

template <class Real>
inline void spread_where(typename Numbers<Real>::Bool lanes, Member<Real>* members, int blocks,
                         int block) {
  for (int lane = 0; lane < Numbers<Real>::lanes; ++lane) {
    if (lane_of(lanes, lane)) {
      spread(members, blocks, block, lane);
    }
  }
}

// The axes of a block at the wall: those of its assembly, but of a rectangle its own.
template <class T, class Real>
inline Axes<Real> axes_at_wall(const T&, const Axes<Real>& axes, const Member<Real>&) {
  return axes;
}
template <class T, class Real>
inline Axes<Real> axes_at_wall(const Box<T>&, const Axes<Real>& axes, const Member<Real>& m) {
  return turned_axes(axes, m.turn);
}

// Moves an assembly inward by a corner's depth, in the given lanes alone and where it is beyond the
// tolerance; returns where that was.
template <class Real, class T>
inline auto push_corner(const Contact<Real>& corner, T tolerance,
                        typename Numbers<Real>::Bool lanes, Pose<Real>& pose) ->
    typename Numbers<Real>::Bool {
  const auto outside = lanes & (corner.depth > Real(tolerance));
  const Real shift = keep(outside, corner.depth);
  pose.x = pose.x - corner.nx * shift;
  pose.y = pose.y - corner.ny * shift;
  return outside;
}

// The same for the corners of one of its blocks, each seen from where the last one has led.
template <class Real, class T, class Half>
inline auto push_member(const WallView<T>& wall, Half h, T tolerance,
                        typename Numbers<Real>::Bool lanes, const Axes<Real>& axes,
                        const Arm<Real>& arm, Pose<Real>& pose) -> typename Numbers<Real>::Bool {
  Contact<Real> first, second;
  if (wall.radius > T(0)) {
    leading_corners(pose.x + arm.x, pose.y + arm.y, h, axes, arm, first, second);
    measure_circle(first, wall.radius, pose.x, pose.y);
    const auto outside = push_corner(first, tolerance, lanes, pose);
    measure_circle(second, wall.radius, pose.x, pose.y);
    return outside | push_corner(second, tolerance, lanes, pose);
  }
  auto outside = Real(T(0)) > Real(T(0));
  for (int e = 0; e < wall.edge_count; ++e) {
    const PreparedEdge<T>& edge = wall.edges[e];
    leading_corners(Real(edge.normal_x), Real(edge.normal_y), h, axes, arm, first, second);
    measure_edge(first, edge, pose.x, pose.y);
    outside = outside | push_corner(first, tolerance, lanes, pose);
  }
  return outside;
}

// Puts a block, in one lane, back to where it was before the step, at rest.
template <class Real>
inline void take_back_member(Member<Real>& m, int lane) {
  using T = typename Numbers<Real>::Scalar;
  const T cosine = get(m.axes_before.cosine, lane), sine = get(m.axes_before.sine, lane);
  const T offset_x = get(m.offset_x, lane), offset_y = get(m.offset_y, lane);
  put(m.pose.x, lane, get(m.before.x, lane));
  put(m.pose.y, lane, get(m.before.y, lane));
  put(m.pose.theta, lane, get(m.before.theta, lane));
  put(m.axes.cosine, lane, cosine);
  put(m.axes.sine, lane, sine);
  put(m.arm.x, lane, offset_x * cosine - offset_y * sine);
  put(m.arm.y, lane, offset_x * sine + offset_y * cosine);
  put_rest(m.motion, lane);
  put_rest(m.drag, lane);
}

// The same for a block's assembly.
template <class Real>
inline void take_back(Member<Real>* members, int blocks, int block, int lane) {
  const Int32 root = get(members[block].root, lane);
  for (int b = root; b < blocks; ++b) {
    Member<Real>& m = members[b];
    if (get(m.root, lane) != root) {
      continue;
    }
    take_back_member(m, lane);
  }
}

// What spans the tank and has turned into its walls cannot be pushed inside: it has not moved in
// this step.
template <class Real, class T, class Half>
inline void take_back_jammed(const WallView<T>& wall, Half h, typename Numbers<Real>::Bool lanes,
                             Member<Real>* members, int blocks) {
  constexpr T tolerance = T(1e-4);
  for (int b = 0; b < blocks; ++b) {
    Pose<Real> pushed = members[b].pose;
    const auto outside =
        push_member<Real, T>(wall, h, tolerance, lanes,
                             axes_at_wall(h, members[b].axes, members[b]), members[b].arm, pushed);
    for (int lane = 0; lane < Numbers<Real>::lanes && any(outside); ++lane) {
      if (lane_of(outside, lane)) {
        take_back(members, blocks, b, lane);
      }
    }
  }
}

// One corner's way inward can lead another block of the assembly outward: go round until none is
// outside. Only the given lanes move, so that no lane depends on its neighbours.
template <class Real, class T, class Half>
inline void push_members_inside(const WallView<T>& wall, Half h, typename Numbers<Real>::Bool lanes,
                                Member<Real>* members, int blocks) {
  constexpr int most_rounds = 16;
  constexpr T tolerance = T(1e-6);
  for (int round = 0; round < most_rounds; ++round) {
    auto moved = Real(T(0)) > Real(T(0));
    for (int b = 0; b < blocks; ++b) {
      Member<Real>& m = members[b];
      const auto outside = push_member<Real, T>(wall, h, tolerance, lanes,
                                                axes_at_wall(h, m.axes, m), m.arm, m.pose);
      if (any(outside)) {
        spread_where(outside, members, blocks, b);
        moved = moved | outside;
      }
    }
    if (!any(moved)) {
      return;
    }
    lanes = moved;
  }
  take_back_jammed(wall, h, lanes, members, blocks);
}

// `h` is half the side of a block, its disc or its box.
template <class Real, class T, class Half>
inline void meet_walls(const WallView<T>& wall, Half h, Member<Real>* members, int blocks) {
  const Real zero{T(0)};
  auto in_assemblies = zero > zero;
  for (int b = 0; b < blocks; ++b) {
    Member<Real>& m = members[b];
    const auto touched = meet_wall(
        wall, h, m.per_inertia, m.arm, [&](Real) { return axes_at_wall(h, m.axes, m); }, m.pose,
        m.motion);
    if (!any(touched)) {
      continue;
    }
    forget_drag(touched, m);
    const auto joined = touched & (m.per_count < Real(T(0.75)));
    if (any(joined)) {
      spread_where(joined, members, blocks, b);
      in_assemblies = in_assemblies | joined;
    }
  }
  if (any(in_assemblies)) {
    push_members_inside(wall, h, in_assemblies, members, blocks);
  }
  for (int b = 0; b < blocks; ++b) {
    members[b].x = members[b].pose.x + members[b].arm.x;
    members[b].y = members[b].pose.y + members[b].arm.y;
  }
}

// Calls with half the side of a block, its disc or its box.
template <class T, class Visit>
inline void with_half(const BlockShape<T>& block, const BodyShape<T>& shape, const Visit& visit) {
  if (shape.disc_radius > T(0)) {
    visit(Disc<T>{shape.disc_radius});
  } else if (shape.panel_count > 0) {
    visit(Box<T>{shape.half_length, shape.half_width, shape.reach});
  } else {
    visit(block.half_side);
  }
}

template <class Real, class T, class Law>
inline void meet_walls(const Physics<Real, T, Law>& physics, Member<Real>* members, int blocks) {
  with_half(physics.block, physics.shape,
            [&](const auto& half) { meet_walls(physics.wall, half, members, blocks); });
}

DRIFTWALK_LANES_END
