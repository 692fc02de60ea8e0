// The state of a pack of worlds with several blocks, one world per lane.
//
// Every block carries a copy of the motion of the assembly that it is part of. The copies in an
// assembly see the same numbers in the same order, so they stay equal bit for bit, and nothing has
// to be looked up at an index that differs from lane to lane.
#pragma once

#include "driftwalk/assembly/kernel.hpp"
#include "driftwalk/physics/integrator.hpp"
#include "driftwalk/physics/laws/mixed.hpp"
#include "driftwalk/physics/wall.hpp"

DRIFTWALK_LANES_BEGIN

// A block, with the assembly that it is part of as the body.
template <class Real>
struct Member : Body<Real> {
  using Int = typename Numbers<Real>::Int;
  using Bool = typename Numbers<Real>::Bool;
  // of the assembly
  Axes<Real> axes;   // of pose.theta
  Pose<Real> before; // at the start of the step
  Axes<Real> axes_before;
  Int root;         // lowest block of the assembly
  Real per_count;   // 1 / number of its blocks
  Real per_inertia; // its mass / its moment of inertia [1/m^2]
  Real lightness;   // a block's moment of inertia / its own
  // of the block
  Real offset_x, offset_y; // from the centre of mass, in the assembly's frame [m]
  Arm<Real> arm;           // the same in the tank's frame
  Axes<Real> turn;         // of what latches as it lies: its axes in the assembly's frame
  Real x, y;               // position [m]
  Bool covered[4];         // faces that the water does not reach
  Real normals[4];         // of this force interval and the next
  // of the step under way
  Motion<Real> noise; // acceleration of the assembly by the stochastic forces
  Motion<Real> ahead; // v*
};

// The axes of a block that has turned from those of its assembly.
template <class Real>
inline Axes<Real> turned_axes(const Axes<Real>& axes, const Axes<Real>& turn) {
  return {axes.cosine * turn.cosine - axes.sine * turn.sine,
          axes.sine * turn.cosine + axes.cosine * turn.sine};
}

// Sums of a step, of a block and then of its assembly.
inline constexpr int noise_sums = 3; // force per mass x, y; torque per mass
inline constexpr int drag_sums_kept = 5;
template <class Real>
struct Sums {
  Real part[drag_sums_kept], total[drag_sums_kept];
};

// The lattice side of a block, per lane.
struct BlockBook {
  std::int16_t cell_x, cell_y;
  std::uint8_t quarter, joined;
  std::uint8_t kind = 0; // of typed faces
  double turn = 0, turn_cosine = 1, turn_sine = 0;
};

// Where the world of a lane is in its run.
struct LaneBook {
  std::int64_t world = -1;
  std::int64_t first_step = 0; // in steps of the pack
  std::uint64_t key = 0;
  std::int32_t event_count = 0, first_contact = -1;
  std::int32_t assemblies = 0;
  bool running = false;
  BondList bonds = {};
};

// One number of one lane, of a pack or of a single number.
template <class T, int N>
inline T get(const Pack<T, N>& a, int lane) {
  return a.v[lane];
}
// Of a pack of doubles, integers are wide.
template <int N>
inline Int32 get(const Pack<std::int64_t, N>& a, int lane) {
  return static_cast<Int32>(a.v[lane]);
}
template <class T>
  requires std::is_arithmetic_v<T>
inline T get(const T& a, int) {
  return a;
}
template <class T, int N, class Value>
inline void put(Pack<T, N>& a, int lane, Value value) {
  a.v[lane] = static_cast<T>(value);
}
template <class T, class Value>
  requires(std::is_arithmetic_v<T> && !std::is_same_v<T, bool>)
inline void put(T& a, int, Value value) {
  a = static_cast<T>(value);
}
template <int N, class Word>
inline void put(Mask<N, Word>& a, int lane, bool value) {
  a.v[lane] = value ? -1 : 0;
}
inline void put(bool& a, int, bool value) {
  a = value;
}

// Tells a lane's drag coefficient to a law that has one of its own.
template <class Law>
inline void put_drag_coefficient(Law&, int, double) {}
template <class Real>
inline void put_drag_coefficient(MixedDrag<Real>& law, int lane, double value) {
  put(law.quadratic, lane, value);
}

template <class Real>
inline void put_rest(Motion<Real>& motion, int lane) {
  put(motion.vx, lane, 0);
  put(motion.vy, lane, 0);
  put(motion.omega, lane, 0);
}

// The value where the mask holds, else zero.
template <class T, int N>
inline Pack<T, N> keep(MaskOf<T, N> mask, Pack<T, N> value) {
  return (typename Pack<T, N>::Vector)((typename MaskOf<T, N>::Vector)value.v & mask.v);
}
template <class T>
  requires std::is_floating_point_v<T>
inline T keep(bool mask, T value) {
  return mask ? value : T(0);
}
template <class T, int N>
inline MaskOf<T, N> equal(Pack<T, N> a, Pack<T, N> b) {
  return a == b;
}
inline bool equal(Int32 a, Int32 b) {
  return a == b;
}

DRIFTWALK_LANES_END
