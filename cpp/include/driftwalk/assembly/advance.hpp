// One time step of the assemblies in a pack of worlds: the integrator of physics/integrator.hpp
// with forces and torques summed over the members (docs/explanation/assembly.md). With one block it
// gives the same bits.
#pragma once

#include "driftwalk/assembly/member.hpp"
#include "driftwalk/physics/drag.hpp"
#include "driftwalk/physics/open_faces.hpp"
#include "driftwalk/physics/panels.hpp"
#include "driftwalk/physics/physics.hpp"
#include "driftwalk/physics/water.hpp"

DRIFTWALK_LANES_BEGIN

// Adds what the members of each assembly contribute, in the order of the blocks: for a few blocks,
// one world per lane. Many have crowd.hpp.
template <int Count, class Real>
inline void sum_masked(const Member<Real>* members, Sums<Real>* sums, int blocks) {
  using T = typename Numbers<Real>::Scalar;
  for (int b = 0; b < blocks; ++b) {
    Real total[Count];
    for (int k = 0; k < Count; ++k) {
      total[k] = Real(T(0));
    }
    for (int c = 0; c < blocks; ++c) {
      const auto same = equal(members[b].root, members[c].root);
      for (int k = 0; k < Count; ++k) {
        total[k] = total[k] + keep(same, sums[c].part[k]);
      }
    }
    for (int k = 0; k < Count; ++k) {
      sums[b].total[k] = total[k];
    }
  }
}

// `sum` adds so many parts of each row.
template <class Real, class T, class Law, class Sum>
inline void sum_noise(const Physics<Real, T, Law>& physics, int half, Member<Real>* members,
                      Sums<Real>* sums, int blocks, const Sum& sum) {
  for (int b = 0; b < blocks; ++b) {
    const Member<Real>& m = members[b];
    const Real x = m.normals[2 * half] * physics.world.noise_scale;
    const Real y = m.normals[2 * half + 1] * physics.world.noise_scale;
    sums[b].part[0] = x;
    sums[b].part[1] = y;
    sums[b].part[2] = m.arm.x * y - m.arm.y * x;
  }
  sum.template operator()<noise_sums>();
  for (int b = 0; b < blocks; ++b) {
    Member<Real>& m = members[b];
    m.noise.vx = sums[b].total[0] * m.per_count;
    m.noise.vy = sums[b].total[1] * m.per_count;
    m.noise.omega = sums[b].total[2] * (m.per_inertia * m.per_count);
  }
}

// Turns a block's sums into accelerations of a block alone, and adds that by the water's own. Of
// the water's, the mass that it pushes is at the block's centre, on the arm.
template <class Real, class T, class Law>
inline void add_water(const Physics<Real, T, Law>& physics, Real x, Real y, const Axes<Real>& axes,
                      const Arm<Real>& arm, const Axes<Real>& turn, Sums<Real>& sums) {
  const bool turns = physics.shape.disc_radius == T(0);
  const Motion<Real> water = physics.shape.panel_count > 0
                                 ? water_acceleration(physics.water, physics.shape,
                                                      turns ? turned_axes(axes, turn) : axes, x, y)
                                 : water_acceleration(physics.water, physics.block, x, y, axes);
  const Real per_mass = physics.world.drag_per_mass, per_inertia = physics.world.drag_per_inertia;
  sums.part[0] = sums.part[0] * per_mass + water.vx;
  sums.part[1] = sums.part[1] * per_mass + water.vy;
  sums.part[2] = sums.part[2] * per_inertia + water.omega +
                 (arm.x * water.vy - arm.y * water.vx) * Real(physics.step.per_inertia);
}

// Where joined faces feel a share of the drag, it is so far from that without them to that with
// them.
template <class Real, class T, class Law>
inline void blend_hidden(const Physics<Real, T, Law>& physics, Real x, Real y,
                         const Axes<Real>& axes, const Motion<Real>& own, const Member<Real>& m,
                         DragSums<Real>& drag) {
  bool joined = false;
  for (const auto& covered : m.covered) {
    joined = joined || any(covered);
  }
  if (!joined) {
    return;
  }
  const DragSums<Real> full = drag_sums(physics.law, physics.block, physics.flow, x, y, axes, own);
  const T share = physics.hidden_share;
  drag.force_x = drag.force_x + (full.force_x - drag.force_x) * share;
  drag.force_y = drag.force_y + (full.force_y - drag.force_y) * share;
  drag.torque = drag.torque + (full.torque - drag.torque) * share;
  drag.conductance = drag.conductance + (full.conductance - drag.conductance) * share;
}

// Drag of a block in its assembly, about its own centre. Of discs and rectangles none hides
// another: the sum over the panels of each is that of one alone, not inlined for the squares' sake.
template <class Real, class T, class Law>
[[gnu::noinline]] DragSums<Real> drag_of_panels(const Physics<Real, T, Law>& physics, Real x,
                                                Real y, const Axes<Real>& axes,
                                                const Motion<Real>& own, const Axes<Real>& turn) {
  return panel_sums(physics.law, physics.shape, physics.flow, x, y, turned_axes(axes, turn), own);
}

template <class Real, class T, class Law>
inline DragSums<Real> drag_of_member(const Physics<Real, T, Law>& physics, Real x, Real y,
                                     const Axes<Real>& axes, const Motion<Real>& own,
                                     const Member<Real>& m) {
  if (physics.shape.panel_count > 0) {
    return drag_of_panels(physics, x, y, axes, own, m.turn);
  }
  const Real covered{static_cast<T>(closing_where_covered)};
  DragSums<Real> drag =
      drag_sums(physics.law, physics.block, physics.flow, x, y, axes, own,
                [&](int face, Real closing) { return select(m.covered[face], covered, closing); });
  if (physics.hidden_share > T(0)) {
    blend_hidden(physics, x, y, axes, own, m, drag);
  }
  return drag;
}

// A block half a step ahead.
template <class Real>
struct AheadMember {
  Real x, y;
  Axes<Real> axes;
  Arm<Real> arm;
  Motion<Real> own;
};

template <class Real, class T, class Law>
inline AheadMember<Real> ahead_of(const Physics<Real, T, Law>& physics, Member<Real>& m) {
  const Ahead<Real> ahead = look_ahead(physics.step, m, m.noise);
  m.ahead = ahead.motion;
  const Axes<Real> axes = axes_at(ahead.pose.theta);
  const Real arm_x = m.offset_x * axes.cosine - m.offset_y * axes.sine;
  const Real arm_y = m.offset_x * axes.sine + m.offset_y * axes.cosine;
  return {ahead.pose.x + arm_x,
          ahead.pose.y + arm_y,
          axes,
          {arm_x, arm_y},
          {m.ahead.vx - m.ahead.omega * arm_y, m.ahead.vy + m.ahead.omega * arm_x, m.ahead.omega}};
}

// Its drag, about its own centre, about its assembly's centre of mass.
template <class Real, class T, class Law>
inline void add_drag(const Physics<Real, T, Law>& physics, const AheadMember<Real>& ahead,
                     const DragSums<Real>& drag, const Axes<Real>& turn, Sums<Real>& sums) {
  const Arm<Real>& arm = ahead.arm;
  sums.part[0] = drag.force_x;
  sums.part[1] = drag.force_y;
  sums.part[2] = drag.torque + (arm.x * drag.force_y - arm.y * drag.force_x);
  sums.part[3] = drag.conductance;
  sums.part[4] = drag.conductance * (arm.x * arm.x + arm.y * arm.y);
  if (physics.water.count > 0) {
    add_water(physics, ahead.x, ahead.y, ahead.axes, arm, turn, sums);
  }
}

// Whether the faces that the water reaches are to be taken side by side: of a pack whose law and
// flow are the same in each lane, where three in ten are covered. With fewer, moving them costs
// more than it saves: 4 blocks that assemble, single precision, 16 lanes, ran 10 % slower where any
// covered face did, and a batch of joined tanks is as fast from 0 to 35 %.
template <class Real, class T, class Law>
inline bool has_faces_to_skip(const Physics<Real, T, Law>& physics, const Member<Real>* members,
                              int rows) {
  if (!std::is_empty_v<Law> || physics.flow.lanes != nullptr || physics.shape.panel_count > 0 ||
      physics.hidden_share > T(0)) {
    return false;
  }
  auto held = members[0].covered[0].v;
  held ^= held;
  for (int row = 0; row < rows; ++row) {
    for (const auto& face : members[row].covered) {
      held -= face.v; // minus one where it is covered
    }
  }
  int count = 0;
  for (int lane = 0; lane < Numbers<Real>::lanes; ++lane) {
    count += static_cast<int>(held[lane]);
  }
  return 10 * count > 3 * 4 * rows * Numbers<Real>::lanes;
}

// Drag of blocks whose open faces are taken side by side; not inlined, for the sake of those
// that have none to skip.
template <class Real, class T, class Law>
[[gnu::noinline]] void feel_drag_of_open_faces(const Physics<Real, T, Law>& physics,
                                               Member<Real>* members, Sums<Real>* sums, int rows) {
  AheadMember<Real> ahead[most_open_blocks];
  OpenFaces<Real> faces;
  for (int row = 0; row < rows; ++row) {
    ahead[row] = ahead_of(physics, members[row]);
    faces.add(physics.block, physics.flow, ahead[row].x, ahead[row].y, ahead[row].axes,
              ahead[row].own, members[row].covered);
  }
  faces.sum(physics.law, physics.block, physics.flow);
  for (int row = 0; row < rows; ++row) {
    const DragSums<Real> drag =
        faces.take(physics.block, physics.flow.unit, ahead[row].axes, ahead[row].own);
    add_drag(physics, ahead[row], drag, members[row].turn, sums[row]);
  }
}

template <class Real, class T, class Law>
inline void feel_drag(const Physics<Real, T, Law>& physics, Member<Real>* members, Sums<Real>* sums,
                      int rows) {
  if constexpr (moves_lanes<Real>) {
    if (has_faces_to_skip(physics, members, rows)) {
      feel_drag_of_open_faces(physics, members, sums, rows);
      return;
    }
  }
  for (int row = 0; row < rows; ++row) {
    const AheadMember<Real> ahead = ahead_of(physics, members[row]);
    add_drag(physics, ahead,
             drag_of_member(physics, ahead.x, ahead.y, ahead.axes, ahead.own, members[row]),
             members[row].turn, sums[row]);
  }
}

template <class Real>
inline void find_arm(Member<Real>& m) {
  m.axes = axes_at(m.pose.theta);
  m.arm.x = m.offset_x * m.axes.cosine - m.offset_y * m.axes.sine;
  m.arm.y = m.offset_x * m.axes.sine + m.offset_y * m.axes.cosine;
}

// The second half of the step, from the sums over the assembly.
template <class Real, class T, class Law>
inline void finish_member(const Physics<Real, T, Law>& physics, const Real* total,
                          Member<Real>& m) {
  const T half = T(0.5) * physics.step.dt;
  const T turning =
      (physics.shape.panel_count > 0 ? physics.shape.turning_share : turning_share(physics.block)) *
      half;
  const Real per_mass = physics.world.drag_per_mass, per_inertia = physics.world.drag_per_inertia;
  // Where the water pushes, or another block, the sums are accelerations.
  const bool done = physics.water.count > 0 || physics.pulled;
  const Real by_mass = done ? Real(T(1)) : per_mass, by_inertia = done ? Real(T(1)) : per_inertia;
  WaterPush<Real> push;
  push.acceleration = {total[0] * by_mass * m.per_count, total[1] * by_mass * m.per_count,
                       total[2] * by_inertia * m.lightness};
  push.stiffness = total[3] * per_mass * half * m.per_count;
  push.spin_stiffness =
      (total[3] * per_inertia * turning + total[4] * per_inertia * half) * m.lightness;
  m.before = m.pose;
  m.axes_before = m.axes;
  finish_step(physics.step, m.noise, m.ahead, push, m);
  find_arm(m);
}

// Rows of lanes: blocks of a pack of worlds, or those of one world. `pull` adds what blocks do to
// each other to the sums of each.
template <class Real, class T, class Law, class Sum, class Pull>
inline void advance(const Physics<Real, T, Law>& physics, int half, Member<Real>* members,
                    Sums<Real>* sums, int rows, const Sum& sum, const Pull& pull) {
  sum_noise(physics, half, members, sums, rows, sum);
  for (int row = 0; row < rows; row += most_open_blocks) {
    const int left = rows - row;
    feel_drag(physics, members + row, sums + row,
              left < most_open_blocks ? left : most_open_blocks);
  }
  pull();
  sum.template operator()<drag_sums_kept>();
  for (int row = 0; row < rows; ++row) {
    finish_member(physics, sums[row].total, members[row]);
  }
}

DRIFTWALK_LANES_END
