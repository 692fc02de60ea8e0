// One time step of the assemblies in a pack of worlds: the integrator of physics/integrator.hpp
// with forces and torques summed over the members (docs/explanation/assembly.md). With one block it
// gives the same bits.
#pragma once

#include "driftwalk/assembly/member.hpp"

DRIFTWALK_LANES_BEGIN

// Up to this many blocks the sums over members are masked vectors, beyond they go lane by lane.
inline constexpr int most_blocks_masked = 8;

template <class Real, class T>
struct Physics {
  BlockShape<T> block;
  FlowView<T> flow;
  WallView<T> wall;
  StepConstants<T> step;
  WorldConstants<Real> drag;
  Real noise_scale; // stochastic force per normal and mass of a block [m/s^2]
};

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

template <int Count, class Real>
inline void sum_by_lane(const Member<Real>* members, Sums<Real>* sums, int blocks) {
  using T = typename Numbers<Real>::Scalar;
  for (int b = 0; b < blocks; ++b) {
    for (int k = 0; k < Count; ++k) {
      sums[b].total[k] = Real(T(0));
    }
  }
  for (int lane = 0; lane < Numbers<Real>::lanes; ++lane) {
    for (int b = 0; b < blocks; ++b) {
      Sums<Real>& at = sums[get(members[b].root, lane)];
      for (int k = 0; k < Count; ++k) {
        put(at.total[k], lane, get(at.total[k], lane) + get(sums[b].part[k], lane));
      }
    }
    // The lowest block of an assembly has the sum; it comes before the others.
    for (int b = 0; b < blocks; ++b) {
      const Sums<Real>& at = sums[get(members[b].root, lane)];
      for (int k = 0; k < Count; ++k) {
        put(sums[b].total[k], lane, get(at.total[k], lane));
      }
    }
  }
}

// Adds what the members of each assembly contribute, in the order of the blocks.
template <int Count, class Real>
inline void sum_members(const Member<Real>* members, Sums<Real>* sums, int blocks) {
  if (blocks <= most_blocks_masked) {
    sum_masked<Count>(members, sums, blocks);
  } else {
    sum_by_lane<Count>(members, sums, blocks);
  }
}

template <class Real, class T>
inline void sum_noise(const Physics<Real, T>& physics, int half, Member<Real>* members,
                      Sums<Real>* sums, int blocks) {
  for (int b = 0; b < blocks; ++b) {
    const Member<Real>& m = members[b];
    const Real x = m.normals[2 * half] * physics.noise_scale;
    const Real y = m.normals[2 * half + 1] * physics.noise_scale;
    sums[b].part[0] = x;
    sums[b].part[1] = y;
    sums[b].part[2] = m.arm.x * y - m.arm.y * x;
  }
  sum_members<noise_sums>(members, sums, blocks);
  for (int b = 0; b < blocks; ++b) {
    Member<Real>& m = members[b];
    m.noise.vx = sums[b].total[0] * m.per_count;
    m.noise.vy = sums[b].total[1] * m.per_count;
    m.noise.omega = sums[b].total[2] * (m.per_inertia * m.per_count);
  }
}

// Drag of a block half a step ahead, about its assembly's centre of mass.
template <class Real, class T>
inline void feel_drag(const Physics<Real, T>& physics, Member<Real>& m, Sums<Real>& sums) {
  const T half = T(0.5) * physics.step.dt, quarter = T(0.25) * physics.step.dt;
  const FlowView<T>& flow = physics.flow;
  const Motion<Real>& v = m.motion;
  Motion<Real>& ahead = m.ahead;
  ahead.vx = v.vx + (m.drag.vx + m.noise.vx) * half;
  ahead.vy = v.vy + (m.drag.vy + m.noise.vy) * half;
  ahead.omega = v.omega + (m.drag.omega + m.noise.omega) * half;
  const Axes<Real> axes = axes_at(m.pose.theta + (v.omega + ahead.omega) * quarter);
  const Real arm_x = m.offset_x * axes.cosine - m.offset_y * axes.sine;
  const Real arm_y = m.offset_x * axes.sine + m.offset_y * axes.cosine;
  // The clamp is for memory safety alone: a NaN or a runaway stays on the table.
  const Real x =
      clamp_to((m.pose.x + (v.vx + ahead.vx) * quarter) + arm_x, flow.low_x, flow.high_x);
  const Real y =
      clamp_to((m.pose.y + (v.vy + ahead.vy) * quarter) + arm_y, flow.low_y, flow.high_y);
  const Motion<Real> own{ahead.vx - ahead.omega * arm_y, ahead.vy + ahead.omega * arm_x,
                         ahead.omega};
  // Any speed that no water reaches.
  const Real covered{T(-1e9)};
  const DragSums<Real> drag =
      drag_sums(physics.block, flow, x, y, axes, own,
                [&](int face, Real closing) { return select(m.covered[face], covered, closing); });
  sums.part[0] = drag.force_x;
  sums.part[1] = drag.force_y;
  sums.part[2] = drag.torque + (arm_x * drag.force_y - arm_y * drag.force_x);
  sums.part[3] = drag.conductance;
  sums.part[4] = drag.conductance * (arm_x * arm_x + arm_y * arm_y);
}

template <class Real>
inline void find_arm(Member<Real>& m) {
  m.axes = axes_at(m.pose.theta);
  m.arm.x = m.offset_x * m.axes.cosine - m.offset_y * m.axes.sine;
  m.arm.y = m.offset_x * m.axes.sine + m.offset_y * m.axes.cosine;
}

// The second half of the step, from the sums over the assembly.
template <class Real, class T>
inline void finish_step(const Physics<Real, T>& physics, const Real* total, Member<Real>& m) {
  const T dt = physics.step.dt, half = T(0.5) * dt;
  const Real one{T(1)}, per_mass = physics.drag.drag_per_mass;
  const Real per_inertia = physics.drag.drag_per_inertia;
  const Motion<Real> v = m.motion;
  const Real damping = one / (one + total[3] * per_mass * half * m.per_count);
  const T turning = T(4.0 / 3.0) * physics.block.half_side * physics.block.half_side * half;
  const Real spin_damping =
      one /
      (one + (total[3] * per_inertia * turning + total[4] * per_inertia * half) * m.lightness);
  Motion<Real> mean;
  mean.vx = m.ahead.vx + (total[0] * per_mass * m.per_count - m.drag.vx) * damping * half;
  mean.vy = m.ahead.vy + (total[1] * per_mass * m.per_count - m.drag.vy) * damping * half;
  mean.omega =
      m.ahead.omega + (total[2] * per_inertia * m.lightness - m.drag.omega) * spin_damping * half;
  m.before = m.pose;
  m.axes_before = m.axes;
  m.pose.x = m.pose.x + mean.vx * dt;
  m.pose.y = m.pose.y + mean.vy * dt;
  m.pose.theta = wrap_angle(m.pose.theta + mean.omega * dt);
  m.motion.vx = mean.vx * T(2) - v.vx;
  m.motion.vy = mean.vy * T(2) - v.vy;
  m.motion.omega = mean.omega * T(2) - v.omega;
  m.drag.vx = (m.motion.vx - v.vx) * physics.step.per_dt - m.noise.vx;
  m.drag.vy = (m.motion.vy - v.vy) * physics.step.per_dt - m.noise.vy;
  m.drag.omega = (m.motion.omega - v.omega) * physics.step.per_dt - m.noise.omega;
  find_arm(m);
}

template <class Real, class T>
inline void advance(const Physics<Real, T>& physics, int half, Member<Real>* members,
                    Sums<Real>* sums, int blocks) {
  sum_noise(physics, half, members, sums, blocks);
  for (int b = 0; b < blocks; ++b) {
    feel_drag(physics, members[b], sums[b]);
  }
  sum_members<drag_sums_kept>(members, sums, blocks);
  for (int b = 0; b < blocks; ++b) {
    finish_step(physics, sums[b].total, members[b]);
  }
}

DRIFTWALK_LANES_END
