// What blocks of different assemblies do to each other from a distance: forces along the line
// between two points, or the gradient of an energy. Each force has its equal and opposite one at
// the same place, so momentum and angular momentum are kept to rounding.
#pragma once

#include "driftwalk/assembly/member.hpp"
#include "driftwalk/physics/physics.hpp"

DRIFTWALK_LANES_BEGIN

// A block about half a step ahead.
template <class Real>
struct Pulled {
  Real x, y, vx, vy;             // of its centre
  Axes<Real> axes;               // of its assembly
  Real pole[4];                  // of its faces, in the assembly's frame; 0 of a joined one
  Real force_x, force_y, torque; // about its centre
};

inline float keep(bool mask, float value) {
  return mask ? value : 0.0f;
}

inline const float* numbers_of(const RadialTable& table, float) {
  return table.single;
}
inline const double* numbers_of(const RadialTable& table, double) {
  return table.twice;
}

inline Int32 cell_bits(float value) {
  Int32 bits;
  std::memcpy(&bits, &value, sizeof bits);
  return bits >> 17;
}

template <class T>
  requires std::is_floating_point_v<T>
inline T look_up(const RadialTable& table, T squared) {
  const T* const numbers = numbers_of(table, T(0));
  const Int32 cell = cell_bits(static_cast<float>(squared)) - table.first;
  if (cell < 0) {
    return numbers[0];
  }
  const Int32 at = cell < table.cells ? cell : table.cells - 1;
  const Int32 bits = (at + table.first) << 17;
  float start;
  std::memcpy(&start, &bits, sizeof start);
  return numbers[2 * at] + numbers[2 * at + 1] * (squared - T(start));
}

template <int N>
inline FloatPack<N> look_up(const RadialTable& table, FloatPack<N> squared) {
  typedef typename IntPack<N>::Vector Bits;
  const Bits all = (Bits)squared.v >> 17;
  const Bits first = Bits{} + table.first, last = first + (table.cells - 1);
  const Bits low = all < first ? first : all, cell = low > last ? last : low;
  const FloatPack<N> start{(typename FloatPack<N>::Vector)(cell << 17)};
  alignas(sizeof(Bits)) Int32 at[N];
  const Bits twice = (cell - first) * 2;
  std::memcpy(at, &twice, sizeof twice);
  FloatPack<N> value, slope;
  for (int lane = 0; lane < N; ++lane) {
    value.v[lane] = table.single[at[lane]];
    slope.v[lane] = table.single[at[lane] + 1];
  }
  return value + slope * max(squared - start, FloatPack<N>(0.0f));
}

template <int N>
inline DoublePack<N> look_up(const RadialTable& table, DoublePack<N> squared) {
  return by_lanes(squared, [&](double one) { return look_up(table, one); });
}

// An attraction `strength` times the way (dx, dy) from the first to the second.
template <class Real>
inline void attract(Real strength, Real dx, Real dy, Pulled<Real>& a, Pulled<Real>& b) {
  const Real force_x = strength * dx, force_y = strength * dy;
  a.force_x = a.force_x + force_x;
  a.force_y = a.force_y + force_y;
  b.force_x = b.force_x - force_x;
  b.force_y = b.force_y - force_y;
}

// Where the faces' points are, from the centre of the block.
template <class Real>
struct FacePoints {
  Real x[4], y[4];
  FacePoints(const Axes<Real>& axes, Real lever)
      : x{axes.cosine * lever, -axes.sine * lever, -axes.cosine * lever, axes.sine * lever},
        y{axes.sine * lever, axes.cosine * lever, -axes.sine * lever, -axes.cosine * lever} {}
};

template <class Real>
inline void pull_faces(const PullRules& rules, typename Numbers<Real>::Bool where, Real dx, Real dy,
                       Pulled<Real>& a, Pulled<Real>& b) {
  using T = typename Numbers<Real>::Scalar;
  const Real lever{static_cast<T>(rules.lever)};
  const FacePoints<Real> first(a.axes, lever), second(b.axes, lever);
  const Real sign{rules.like_poles_repel ? T(-1) : T(1)};
  Real pole[4];
  for (int j = 0; j < 4; ++j) {
    pole[j] = keep(where, b.pole[j]) * sign;
  }
  for (int i = 0; i < 4; ++i) {
    const Real from_x = dx - first.x[i], from_y = dy - first.y[i];
    Real sum_x{T(0)}, sum_y{T(0)};
    for (int j = 0; j < 4; ++j) {
      const Real way_x = from_x + second.x[j], way_y = from_y + second.y[j];
      const Real strength =
          look_up(rules.faces, way_x * way_x + way_y * way_y) * (a.pole[i] * pole[j]);
      const Real force_x = strength * way_x, force_y = strength * way_y;
      sum_x = sum_x + force_x;
      sum_y = sum_y + force_y;
      b.torque = b.torque - (second.x[j] * force_y - second.y[j] * force_x);
    }
    a.torque = a.torque + (first.x[i] * sum_y - first.y[i] * sum_x);
    a.force_x = a.force_x + sum_x;
    a.force_y = a.force_y + sum_y;
    b.force_x = b.force_x - sum_x;
    b.force_y = b.force_y - sum_y;
  }
}

// Weights of a quadratic B-spline, and their derivatives, a part `t` of a step past the middle of
// its three coefficients, -1/2 to 1/2.
template <class T>
struct SplineWeights {
  T value[3], slope[3];
  explicit SplineWeights(T t)
      : value{(T(0.5) - t) * (T(0.5) - t) / 2, T(0.75) - t * t, (T(0.5) + t) * (T(0.5) + t) / 2},
        slope{t - T(0.5), -2 * t, t + T(0.5)} {}
};

// Energy's derivatives by the logarithm of the distance, the direction and the angle [J].
template <class T>
struct EnergySlopes {
  T distance, direction, angle;
};

template <class T>
inline EnergySlopes<T> energy_slopes(const OrientedTable& table, T log_distance, T direction,
                                     T angle) {
  const T per_angle = T(table.angles) / T(2 * pi_value);
  const T place[3] = {(log_distance - T(table.first)) * T(table.per_step), direction * per_angle,
                      angle * per_angle};
  int middle[3];
  for (int k = 0; k < 3; ++k) {
    middle[k] = static_cast<int>(__builtin_floor(place[k] + T(0.5)));
  }
  const SplineWeights<T> u(place[0] - T(middle[0])), v(place[1] - T(middle[1])),
      w(place[2] - T(middle[2]));
  const int last = table.distances - 1;
  EnergySlopes<T> slopes{T(0), T(0), T(0)};
  for (int i = 0; i < 3; ++i) {
    const int row = middle[0] + i - 1 < 0 ? 0 : middle[0] + i - 1 > last ? last : middle[0] + i - 1;
    for (int j = 0; j < 3; ++j) {
      const int column = (middle[1] + j - 1 + 2 * table.angles) % table.angles;
      const float* const line = table.coefficient + (row * table.angles + column) * table.angles;
      T sum = 0, slope = 0;
      for (int k = 0; k < 3; ++k) {
        const T coefficient = line[(middle[2] + k - 1 + 2 * table.angles) % table.angles];
        sum += w.value[k] * coefficient;
        slope += w.slope[k] * coefficient;
      }
      slopes.distance += u.slope[i] * v.value[j] * sum;
      slopes.direction += u.value[i] * v.slope[j] * sum;
      slopes.angle += u.value[i] * v.value[j] * slope;
    }
  }
  slopes.distance *= T(table.per_step);
  slopes.direction *= per_angle;
  slopes.angle *= per_angle;
  return slopes;
}

// Of two blocks with axes through their faces, in one world.
template <class T>
inline void pull_oriented(const PullRules& rules, T dx, T dy, Pulled<T>& a, Pulled<T>& b) {
  const T lever = static_cast<T>(rules.lever);
  const FacePoints<T> first(a.axes, lever), second(b.axes, lever);
  const T sign = rules.like_poles_repel ? T(-1) : T(1);
  const T high = static_cast<T>(rules.oriented.high), low = static_cast<T>(rules.oriented.low);
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      const T strength = sign * a.pole[i] * b.pole[j];
      const T x = dx - first.x[i] + second.x[j], y = dy - first.y[i] + second.y[j];
      const T squared = x * x + y * y;
      if (strength == T(0) || !(squared < high * high)) {
        continue;
      }
      const T distance = max(sqrt(squared), low);
      const T along = x * first.x[i] + y * first.y[i], across = y * first.x[i] - x * first.y[i];
      const T same = -(first.x[i] * second.x[j] + first.y[i] * second.y[j]);
      const T turned = first.y[i] * second.x[j] - first.x[i] * second.y[j];
      const EnergySlopes<T> slope =
          energy_slopes(rules.oriented, static_cast<T>(__builtin_log(distance)),
                        static_cast<T>(__builtin_atan2(across, along)),
                        static_cast<T>(__builtin_atan2(turned, same)));
      const T per_square = strength / (distance * distance);
      // On the second: minus the gradient, along the way and across it.
      const T force_x = -(slope.distance * x - slope.direction * y) * per_square;
      const T force_y = -(slope.distance * y + slope.direction * x) * per_square;
      a.force_x -= force_x;
      a.force_y -= force_y;
      b.force_x += force_x;
      b.force_y += force_y;
      a.torque += strength * (slope.direction + slope.angle) -
                  (first.x[i] * force_y - first.y[i] * force_x);
      b.torque += -strength * slope.angle + (second.x[j] * force_y - second.y[j] * force_x);
    }
  }
}

template <class Real>
inline Pulled<typename Numbers<Real>::Scalar> lane_of_pulled(const Pulled<Real>& all, int lane) {
  Pulled<typename Numbers<Real>::Scalar> one;
  const auto take = [lane](const Real& from, auto& to) { to = get(from, lane); };
  take(all.x, one.x), take(all.y, one.y), take(all.vx, one.vx), take(all.vy, one.vy);
  take(all.axes.cosine, one.axes.cosine), take(all.axes.sine, one.axes.sine);
  for (int face = 0; face < 4; ++face) {
    take(all.pole[face], one.pole[face]);
  }
  one.force_x = one.force_y = one.torque = 0;
  return one;
}

template <class Real, class T>
inline void add_lane(const Pulled<T>& one, int lane, Pulled<Real>& all) {
  put(all.force_x, lane, get(all.force_x, lane) + one.force_x);
  put(all.force_y, lane, get(all.force_y, lane) + one.force_y);
  put(all.torque, lane, get(all.torque, lane) + one.torque);
}

// What two blocks do to each other in the worlds where they are of different assemblies.
template <class Real>
inline void pull_pair(const PullRules& rules, typename Numbers<Real>::Bool apart, Pulled<Real>& a,
                      Pulled<Real>& b) {
  using T = typename Numbers<Real>::Scalar;
  const Real dx = b.x - a.x, dy = b.y - a.y;
  const Real squared = dx * dx + dy * dy;
  const typename Numbers<Real>::Bool near =
      apart & (squared < Real(static_cast<T>(rules.reach * rules.reach)));
  if (!any(near)) {
    return;
  }
  if (rules.centres.cells > 0) {
    attract(keep(near, look_up(rules.centres, squared)), dx, dy, a, b);
  }
  if (rules.resistance.cells > 0) {
    const Real parting = (b.vx - a.vx) * dx + (b.vy - a.vy) * dy;
    attract(keep(near, look_up(rules.resistance, squared) * parting), dx, dy, a, b);
  }
  if (rules.faces.cells > 0) {
    pull_faces(rules, near, dx, dy, a, b);
  }
  if (rules.oriented.distances > 0) {
    for (int lane = 0; lane < Numbers<Real>::lanes; ++lane) {
      if (lane_of(near, lane)) {
        Pulled<T> first = lane_of_pulled(a, lane), second = lane_of_pulled(b, lane);
        pull_oriented(rules, get(dx, lane), get(dy, lane), first, second);
        add_lane(first, lane, a);
        add_lane(second, lane, b);
      }
    }
  }
}

// A block where it would be half a step ahead without forces: so the pull by itself keeps energy,
// but for an error that does not grow, and angular momentum (drift, kick, drift).
template <class Real, class T, class Law>
inline void look_at(const Physics<Real, T, Law>& physics, const Member<Real>& m,
                    Pulled<Real>& block) {
  const T half = T(0.5) * physics.step.dt;
  block.axes = axes_at(m.pose.theta + m.motion.omega * half);
  const Real arm_x = m.offset_x * block.axes.cosine - m.offset_y * block.axes.sine;
  const Real arm_y = m.offset_x * block.axes.sine + m.offset_y * block.axes.cosine;
  block.x = m.pose.x + m.motion.vx * half + arm_x;
  block.y = m.pose.y + m.motion.vy * half + arm_y;
  block.vx = m.motion.vx - m.motion.omega * arm_y;
  block.vy = m.motion.vy + m.motion.omega * arm_x;
  block.force_x = block.force_y = block.torque = Real(T(0));
}

// Turns a block's sums into accelerations of a block alone, and adds that by its neighbours.
template <class Real, class T, class Law>
inline void add_pull(const Physics<Real, T, Law>& physics, const Prepared<T>& run,
                     const Member<Real>& m, const Pulled<Real>& block, Sums<Real>& sums) {
  if (physics.water.count == 0) {
    sums.part[0] = sums.part[0] * physics.world.drag_per_mass;
    sums.part[1] = sums.part[1] * physics.world.drag_per_mass;
    sums.part[2] = sums.part[2] * physics.world.drag_per_inertia;
  }
  const Real per_mass{static_cast<T>(1 / run.mass)};
  const Real per_inertia{static_cast<T>(1 / run.inertia)};
  // The assembly's axes half a step ahead turn the offset into the arm.
  const Real arm_x = m.offset_x * block.axes.cosine - m.offset_y * block.axes.sine;
  const Real arm_y = m.offset_x * block.axes.sine + m.offset_y * block.axes.cosine;
  const Real torque = block.torque + (arm_x * block.force_y - arm_y * block.force_x);
  sums.part[0] = sums.part[0] + block.force_x * per_mass;
  sums.part[1] = sums.part[1] + block.force_y * per_mass;
  sums.part[2] = sums.part[2] + torque * per_inertia;
}

template <class Real>
inline void pull_all(const PullRules& rules, const Member<Real>* members, Pulled<Real>* pulled,
                     int blocks) {
  for (int a = 0; a < blocks; ++a) {
    for (int b = a + 1; b < blocks; ++b) {
      const typename Numbers<Real>::Bool apart = !equal(members[a].root, members[b].root);
      if (any(apart)) {
        pull_pair(rules, apart, pulled[a], pulled[b]);
      }
    }
  }
}

// The same in one world whose blocks are in the lanes, from its list of near pairs; of no list all.
template <class Real, class T>
inline void pull_crowd(const PullRules& rules, const Member<Real>* members, Pulled<Real>* pulled,
                       Pulled<T>* alone, int blocks, const PairList* pairs) {
  constexpr int lanes = Numbers<Real>::lanes;
  for (int b = 0; b < blocks; ++b) {
    alone[b] = lane_of_pulled(pulled[b / lanes], b % lanes);
  }
  const auto root = [&](int b) { return get(members[b / lanes].root, b % lanes); };
  const auto pull = [&](int a, int b) {
    if (root(a) != root(b)) {
      pull_pair<T>(rules, true, alone[a], alone[b]);
    }
  };
  for (int k = 0; pairs != nullptr && k < pairs->count; ++k) {
    pull(pairs->pair[k].first, pairs->pair[k].second);
  }
  for (int a = 0; pairs == nullptr && a < blocks; ++a) {
    for (int b = a + 1; b < blocks; ++b) {
      pull(a, b);
    }
  }
  for (int b = 0; b < blocks; ++b) {
    add_lane(alone[b], b % lanes, pulled[b / lanes]);
  }
}

DRIFTWALK_LANES_END
