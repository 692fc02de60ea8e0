// What blocks of different assemblies do to each other from a distance: forces along the line
// between two points, or the gradient of an energy. Each force has its equal and opposite one at
// the same place, so momentum and angular momentum are kept to rounding.
#pragma once

#include "driftwalk/assembly/member.hpp"
#include "driftwalk/flow/bilinear.hpp"
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
  alignas(64) Int32 at[N];
  store_cells(IntPack<N>(cell - first), at);
  keep_stored(at);
  // A cell's two numbers are as wide as a node of the flow; what follows them is not used.
  static_assert(2 * sizeof(float) == flow_record * sizeof(std::int16_t));
  IntPack<N> record[4];
  load_cells(reinterpret_cast<const std::int16_t*>(table.single), at, record);
  const FloatPack<N> value{(typename FloatPack<N>::Vector)record[0].v};
  const FloatPack<N> slope{(typename FloatPack<N>::Vector)record[1].v};
  return value + slope * max(squared - start, FloatPack<N>(0.0f));
}

template <int N>
inline DoublePack<N> look_up(const RadialTable& table, DoublePack<N> squared) {
  return by_lanes(squared, [&](double one) { return look_up(table, one); });
}

// The squared distance from which on a table is 0.
inline float end_of(const RadialTable& table) {
  const Int32 bits = (table.first + table.cells - 1) << 17;
  float end;
  std::memcpy(&end, &bits, sizeof end);
  return end;
}

// The squared distance from which on a step has none of a force of faces.
inline double end_in_step(const PullRules& rules, bool whole, double end) {
  return whole || end < rules.near_end ? end : rules.near_end;
}
inline double reach_in_step(const PullRules& rules, bool whole) {
  return whole ? rules.reach : rules.near_reach;
}

// A number that falls from 1 to 0 between two squared distances, and its slope.
template <class Real>
struct Fade {
  using T = typename Numbers<Real>::Scalar;
  Real from, per;

  Fade(double fading, double end)
      : from{static_cast<T>(fading)}, per{static_cast<T>(1 / (end - fading))} {}
  Real part(Real squared) const { return min(max((squared - from) * per, Real(T(0))), Real(T(1))); }
  Real value(Real at) const { return Real(T(1)) - at * at * (Real(T(3)) - Real(T(2)) * at); }
  Real slope(Real at) const { return Real(T(-6)) * at * (Real(T(1)) - at) * per; }
};

// The share of a force of faces that acts in a step.
template <class Real>
struct StepShare {
  using T = typename Numbers<Real>::Scalar;
  Fade<Real> near;
  Real far, more;

  StepShare(const PullRules& rules, bool whole)
      : near(rules.near_fading, rules.near_end), far{static_cast<T>(whole ? rules.every : 0)},
        more{static_cast<T>(whole ? 1 - rules.every : 1)} {}
  Real value(Real at) const { return far + more * near.value(at); }
};

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

// Turns the axes of a block by quarters, so that its face 0 is the one that looks towards (x, y):
// faces beyond their reach then have the same numbers in all pairs.
template <class Real>
inline void turn_towards(Real x, Real y, Pulled<Real>& block) {
  using T = typename Numbers<Real>::Scalar;
  const Real cosine = block.axes.cosine, sine = block.axes.sine;
  const Real ahead = x * cosine + y * sine, left = y * cosine - x * sine;
  const auto aside = abs(left) > abs(ahead), back = select(aside, left, ahead) < Real(T(0));
  const Real along = select(aside, -sine, cosine), up = select(aside, cosine, sine);
  block.axes = {select(back, -along, along), select(back, -up, up)};
  Real turned[4];
  for (int face = 0; face < 4; ++face) {
    turned[face] = select(aside, block.pole[(face + 1) & 3], block.pole[face]);
  }
  for (int face = 0; face < 4; ++face) {
    block.pole[face] = select(back, turned[(face + 2) & 3], turned[face]);
  }
}

template <class Real>
inline void pull_faces(const PullRules& rules, bool whole, Real dx, Real dy, Pulled<Real>& a,
                       Pulled<Real>& b) {
  using T = typename Numbers<Real>::Scalar;
  const Real lever{static_cast<T>(rules.lever)};
  const Real end{static_cast<T>(end_in_step(rules, whole, end_of(rules.faces)))};
  const StepShare<Real> share(rules, whole);
  turn_towards(dx, dy, a);
  turn_towards(-dx, -dy, b);
  const FacePoints<Real> first(a.axes, lever), second(b.axes, lever);
  const Real sign{rules.like_poles_repel ? T(-1) : T(1)}, none{T(0)};
  for (int i = 0; i < 4; ++i) {
    const Real from_x = dx - first.x[i], from_y = dy - first.y[i];
    Real sum_x = none, sum_y = none;
    for (int j = 0; j < 4; ++j) {
      const Real way_x = from_x + second.x[j], way_y = from_y + second.y[j];
      const Real squared = way_x * way_x + way_y * way_y;
      const Real poles = a.pole[i] * (b.pole[j] * sign);
      if (!any((squared < end) & (poles != none))) {
        continue;
      }
      const Real strength =
          look_up(rules.faces, squared) * poles * share.value(share.near.part(squared));
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

// Of multipoles; returns the least squared distance of two faces.
template <class Real>
inline Real pull_multipoles(const PullRules& rules, bool whole, Real dx, Real dy, Pulled<Real>& a,
                            Pulled<Real>& b) {
  using T = typename Numbers<Real>::Scalar;
  const auto number = [](double value) { return Real(static_cast<T>(value)); };
  const Multipoles& far = rules.multipoles;
  const Real lever = number(rules.lever), softening = number(far.softening);
  const Real end = number(end_in_step(rules, whole, far.end));
  const Fade<Real> fade(far.fading, far.end);
  const StepShare<Real> share(rules, whole);
  Real c[6];
  for (int k = 0; k < 6; ++k) {
    c[k] = number(far.coefficient[k]);
  }
  const Real none = number(0), one = number(1), two = number(2);
  const Real sign = number(rules.like_poles_repel ? -1 : 1);
  turn_towards(dx, dy, a);
  turn_towards(-dx, -dy, b);
  const FacePoints<Real> first(a.axes, one), second(b.axes, one);
  Real nearest = end;
  for (int i = 0; i < 4; ++i) {
    const Real from_x = dx - first.x[i] * lever, from_y = dy - first.y[i] * lever;
    Real sum_x = none, sum_y = none;
    for (int j = 0; j < 4; ++j) {
      const Real x = from_x + second.x[j] * lever, y = from_y + second.y[j] * lever;
      const Real squared = x * x + y * y, poles = a.pole[i] * (b.pole[j] * sign);
      const auto acts = (squared < end) & (poles != none);
      if (!any(acts)) {
        continue;
      }
      nearest = min(nearest, select(acts, squared, end));
      const Real hh = one / (squared + softening), hhh = hh * sqrt(hh);
      const Real along = first.x[i] * x + first.y[i] * y, up = second.x[j] * x + second.y[j] * y;
      // The energy counts the second's normal inwards.
      const Real w = -(first.x[i] * second.x[j] + first.y[i] * second.y[j]), inward = -up;
      const Real turned = first.y[i] * second.x[j] - first.x[i] * second.y[j];
      const Real u = along * inward * hh, v = (along * along + up * up) * hh;
      const Real by_w = c[0] + hh * (c[1] + c[2] * v), by_u = c[3] + hh * (c[4] + c[5] * v);
      const Real by_v = hh * (c[2] * w + c[5] * u);
      const Real energy = w * by_w + u * by_u;
      // Minus twice the derivative by the squared distance, over h^5.
      const Real steep = number(5) * energy + two * (u * by_u + v * by_v - w * c[0] - u * c[3]);
      const Real last = fade.part(squared), near = share.near.part(squared);
      const Real left = fade.value(last), acting = share.value(near);
      const Real felt = poles * hhh;
      const Real scaled = felt * (left * acting);
      const Real fall = fade.slope(last) * acting + left * (share.more * share.near.slope(near));
      const Real strength = scaled * hh * steep - felt * energy * (two * fall);
      // The energy's derivatives by the way along the two normals, and by the cosine.
      const Real per_way = scaled * hh;
      const Real by_first = per_way * (inward * by_u + two * along * by_v);
      const Real by_second = per_way * (along * by_u + two * inward * by_v);
      const Real turning = scaled * by_w * turned;
      const Real force_x = strength * x - by_first * first.x[i] + by_second * second.x[j];
      const Real force_y = strength * y - by_first * first.y[i] + by_second * second.y[j];
      sum_x = sum_x + force_x;
      sum_y = sum_y + force_y;
      a.torque = a.torque - turning - by_first * (first.x[i] * y - first.y[i] * x);
      b.torque = b.torque + turning + by_second * (second.x[j] * y - second.y[j] * x) +
                 lever * (second.x[j] * force_y - second.y[j] * force_x);
    }
    a.torque = a.torque - lever * (first.x[i] * sum_y - first.y[i] * sum_x);
    a.force_x = a.force_x - sum_x;
    a.force_y = a.force_y - sum_y;
    b.force_x = b.force_x + sum_x;
    b.force_y = b.force_y + sum_y;
  }
  return nearest;
}

// Calls `f` with each lane where a mask holds.
template <class Bool, class F>
inline void for_lanes(int lanes, const Bool& mask, const F& f) {
  for (int lane = 0; lane < lanes; ++lane) {
    if (lane_of(mask, lane)) {
      f(lane);
    }
  }
}
#if defined(DRIFTWALK_USE_X86) && defined(__AVX512F__)
template <class F>
inline void for_lanes(int, const Mask<16>& mask, const F& f) {
  for (unsigned left = _mm512_movepi32_mask((__m512i)mask.v); left != 0; left &= left - 1) {
    f(__builtin_ctz(left));
  }
}
#endif

// Pairs of blocks within reach of each other, of one world or of several, as many at a time as
// there are lanes. What a pair does to its blocks depends on nothing but these.
template <class Real>
class PullPairs {
public:
  using T = typename Numbers<Real>::Scalar;
  static constexpr int lanes = Numbers<Real>::lanes;
  struct Place {
    int row, lane;
  };

  PullPairs(const PullRules& rules, bool whole, Pulled<Real>* pulled)
      : rules_(rules), whole_(whole), pulled_(pulled) {}

  void add(Place first, Place second) {
    place_[0][count_] = first;
    place_[1][count_] = second;
    if (++count_ == lanes) {
      pull();
    }
  }

  void pull() {
    if (count_ == 0) {
      return;
    }
    Pulled<Real> a = taken(place_[0]), b = taken(place_[1]);
    const Real dx = b.x - a.x, dy = b.y - a.y, squared = dx * dx + dy * dy;
    if (rules_.centres.cells > 0) {
      attract(look_up(rules_.centres, squared), dx, dy, a, b);
    }
    if (rules_.resistance.cells > 0) {
      const Real parting = (b.vx - a.vx) * dx + (b.vy - a.vy) * dy;
      attract(look_up(rules_.resistance, squared) * parting, dx, dy, a, b);
    }
    if (rules_.faces.cells > 0) {
      pull_faces(rules_, whole_, dx, dy, a, b);
    }
    if (rules_.oriented.distances > 0) {
      const Real nearest =
          rules_.multipoles.on ? pull_multipoles(rules_, whole_, dx, dy, a, b) : Real(T(0));
      const Real high{static_cast<T>(rules_.oriented.high * rules_.oriented.high)};
      for_lanes(lanes, nearest < high, [&](int pair) {
        if (pair >= count_) {
          return;
        }
        Pulled<T> first, second;
        move_lane(a, pair, first, 0);
        move_lane(b, pair, second, 0);
        pull_oriented(rules_, T(get(dx, pair)), T(get(dy, pair)), first, second);
        move_lane(first, 0, a, pair);
        move_lane(second, 0, b, pair);
      });
    }
    for (int pair = 0; pair < count_; ++pair) {
      give(a, pair, place_[0][pair]);
      give(b, pair, place_[1][pair]);
    }
    count_ = 0;
  }

private:
  // Lanes without a pair repeat the first one.
  Pulled<Real> taken(const Place* places) const {
    Pulled<Real> all;
    for (int pair = 0; pair < lanes; ++pair) {
      const Place from = places[pair < count_ ? pair : 0];
      move_lane(pulled_[from.row], from.lane, all, pair);
    }
    all.force_x = all.force_y = all.torque = Real(T(0));
    return all;
  }
  template <class From, class To>
  static void move_lane(const From& from, int lane, To& to, int at) {
    constexpr int numbers = sizeof(Pulled<T>) / sizeof(T);
    const T* const source = reinterpret_cast<const T*>(&from) + lane;
    T* const target = reinterpret_cast<T*>(&to) + at;
    for (int k = 0; k < numbers; ++k) {
      target[k * (sizeof(To) / sizeof(Pulled<T>))] = source[k * (sizeof(From) / sizeof(Pulled<T>))];
    }
  }
  void give(const Pulled<Real>& from, int pair, Place to) const {
    Pulled<Real>& block = pulled_[to.row];
    put(block.force_x, to.lane, get(block.force_x, to.lane) + get(from.force_x, pair));
    put(block.force_y, to.lane, get(block.force_y, to.lane) + get(from.force_y, pair));
    put(block.torque, to.lane, get(block.torque, to.lane) + get(from.torque, pair));
  }

  const PullRules& rules_;
  bool whole_; // whether distant faces act in this step
  Pulled<Real>* pulled_;
  Place place_[2][lanes];
  int count_ = 0;
};

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
inline void pull_all(const PullRules& rules, bool whole, const Member<Real>* members,
                     Pulled<Real>* pulled, int blocks) {
  using T = typename Numbers<Real>::Scalar;
  PullPairs<Real> pairs(rules, whole, pulled);
  const double far = reach_in_step(rules, whole);
  const Real reach{static_cast<T>(far * far)};
  for (int a = 0; a < blocks; ++a) {
    for (int b = a + 1; b < blocks; ++b) {
      const Real dx = pulled[b].x - pulled[a].x, dy = pulled[b].y - pulled[a].y;
      const typename Numbers<Real>::Bool near =
          (dx * dx + dy * dy < reach) & !equal(members[a].root, members[b].root);
      if (any(near)) {
        for_lanes(Numbers<Real>::lanes, near, [&](int lane) { pairs.add({a, lane}, {b, lane}); });
      }
    }
  }
  pairs.pull();
}

// The same in one world whose blocks are in the lanes, from its list of near pairs; of no list all.
template <class Real>
inline void pull_crowd(const PullRules& rules, bool whole, const Member<Real>* members,
                       Pulled<Real>* pulled, int blocks, const PairList* list) {
  using T = typename Numbers<Real>::Scalar;
  constexpr unsigned lanes = Numbers<Real>::lanes; // so that to divide is to shift
  PullPairs<Real> pairs(rules, whole, pulled);
  const double far = reach_in_step(rules, whole);
  const T reach = static_cast<T>(far * far);
  const auto look = [&](int first, int second) {
    const int a = static_cast<int>(first / lanes), at_a = static_cast<int>(first % lanes);
    const int b = static_cast<int>(second / lanes), at_b = static_cast<int>(second % lanes);
    const T dx = get(pulled[b].x, at_b) - get(pulled[a].x, at_a);
    const T dy = get(pulled[b].y, at_b) - get(pulled[a].y, at_a);
    if (dx * dx + dy * dy < reach && get(members[a].root, at_a) != get(members[b].root, at_b)) {
      pairs.add({a, at_a}, {b, at_b});
    }
  };
  for (int k = 0; list != nullptr && k < list->count; ++k) {
    look(list->pair[k].first, list->pair[k].second);
  }
  for (int a = 0; list == nullptr && a < blocks; ++a) {
    for (int b = a + 1; b < blocks; ++b) {
      look(a, b);
    }
  }
  pairs.pull();
}

DRIFTWALK_LANES_END
