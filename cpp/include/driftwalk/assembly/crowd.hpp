// One world of many blocks, with its blocks in the lanes: what they do alike is done for a row of
// them at once, what an assembly does together block after block. The same bits as with one world
// per lane.
#pragma once

#include "driftwalk/assembly/near.hpp"
#include "driftwalk/assembly/walls.hpp"

#include <cstddef>

DRIFTWALK_LANES_BEGIN

// The assemblies of two or more blocks of a world, and where its blocks are.
template <class Real>
struct Crowd {
  using T = typename Numbers<Real>::Scalar;
  static constexpr int lanes = Numbers<Real>::lanes;
  Real *x, *y;               // [row] where the blocks are [m]
  Real *listed_x, *listed_y; // and were when the list of near pairs was made
  std::int32_t bodies;
  std::int32_t* end;   // [body] its last member in `order`, and one on
  std::int32_t* order; // members, body by body
  std::int32_t* body;  // [lowest block] its body, -1 of a block alone
  std::uint8_t* meets; // [body] whether a member is at the wall

  template <class Take>
  void place(const Take& take, std::size_t rows) {
    bodies = 0;
    take(x, rows);
    take(y, rows);
    take(listed_x, rows);
    take(listed_y, rows);
    take(end, rows * lanes);
    take(order, rows * lanes);
    take(body, rows * lanes);
    take(meets, rows * lanes);
  }
  int first(int of) const { return of == 0 ? 0 : end[of - 1]; }

  void list_bodies(const Member<Real>* members, int blocks) {
    const auto root = [&](int b) { return get(members[b / lanes].root, b % lanes); };
    for (int b = 0; b < blocks; ++b) {
      body[b] = 0;
    }
    for (int b = 0; b < blocks; ++b) {
      ++body[root(b)];
    }
    bodies = 0;
    int begin = 0;
    for (int b = 0; b < blocks; ++b) {
      const int count = body[b];
      body[b] = count > 1 ? bodies : -1;
      if (count > 1) {
        end[bodies++] = begin; // filled up below
        begin += count;
      }
    }
    for (int b = 0; b < blocks; ++b) {
      if (const int own = body[root(b)]; own >= 0) {
        order[end[own]++] = b;
      }
    }
  }
};

// Adds what the members of each assembly contribute, in the order of the blocks.
template <int Count, class Real>
inline void sum_crowd(const Crowd<Real>& crowd, Sums<Real>* sums, int rows) {
  using T = typename Numbers<Real>::Scalar;
  constexpr unsigned lanes = Numbers<Real>::lanes;
  for (int row = 0; row < rows; ++row) {
    for (int k = 0; k < Count; ++k) {
      sums[row].total[k] = Real(T(0)) + sums[row].part[k];
    }
  }
  for (int body = 0; body < crowd.bodies; ++body) {
    const int first = crowd.first(body), end = crowd.end[body];
    T total[Count] = {};
    for (int i = first; i < end; ++i) {
      // Unsigned, so that to divide is to shift.
      const unsigned block = static_cast<unsigned>(crowd.order[i]);
      const Sums<Real>& at = sums[block / lanes];
      for (int k = 0; k < Count; ++k) {
        total[k] = total[k] + get(at.part[k], static_cast<int>(block % lanes));
      }
    }
    for (int i = first; i < end; ++i) {
      const unsigned block = static_cast<unsigned>(crowd.order[i]);
      Sums<Real>& at = sums[block / lanes];
      for (int k = 0; k < Count; ++k) {
        put(at.total[k], static_cast<int>(block % lanes), total[k]);
      }
    }
  }
}

// One lane of a row.
template <class Real>
inline Axes<typename Numbers<Real>::Scalar> one_lane(const Axes<Real>& axes, int lane) {
  return {get(axes.cosine, lane), get(axes.sine, lane)};
}
template <class Real>
inline Pose<typename Numbers<Real>::Scalar> one_lane(const Pose<Real>& pose, int lane) {
  return {get(pose.x, lane), get(pose.y, lane), get(pose.theta, lane)};
}
template <class Real>
inline Motion<typename Numbers<Real>::Scalar> one_lane(const Motion<Real>& motion, int lane) {
  return {get(motion.vx, lane), get(motion.vy, lane), get(motion.omega, lane)};
}
template <class Real>
inline Arm<typename Numbers<Real>::Scalar> one_lane(const Arm<Real>& arm, int lane) {
  return {get(arm.x, lane), get(arm.y, lane)};
}

// The walls of one world whose blocks are in the lanes.
template <class Real, class T, class Half>
class CrowdAtWalls {
public:
  static constexpr int lanes = Numbers<Real>::lanes;
  using Bool = typename Numbers<Real>::Bool;

  CrowdAtWalls(const WallView<T>& wall, Half h, Member<Real>* members, Crowd<Real>& crowd, int rows)
      : wall_(wall), h_(h), members_(members), crowd_(crowd), rows_(rows) {}

  void meet() {
    if (bounce()) {
      push_inside();
    }
    for (int row = 0; row < rows_; ++row) {
      Member<Real>& m = members_[row];
      crowd_.x[row] = m.x = m.pose.x + m.arm.x;
      crowd_.y[row] = m.y = m.pose.y + m.arm.y;
    }
  }

private:
  // Returns whether an assembly of two or more has met a wall.
  bool bounce() {
    bool some = false;
    forget_bodies();
    for (int row = 0; row < rows_; ++row) {
      Member<Real>& m = members_[row];
      Pose<Real> pose = m.pose;
      Motion<Real> motion = m.motion;
      const auto touched = meet_wall(
          wall_, h_, m.per_inertia, m.arm, [&](Real) { return axes_at_wall(h_, m.axes, m); }, pose,
          motion);
      if (!any(touched)) {
        continue;
      }
      const auto joined = touched & (m.per_count < Real(T(0.75)));
      m.pose = {select(joined, m.pose.x, pose.x), select(joined, m.pose.y, pose.y), m.pose.theta};
      m.motion = {select(joined, m.motion.vx, motion.vx), select(joined, m.motion.vy, motion.vy),
                  select(joined, m.motion.omega, motion.omega)};
      forget_drag(touched, m);
      if (any(joined)) {
        some = true;
        note_bodies(joined, m);
      }
    }
    for (int body = 0; some && body < crowd_.bodies; ++body) {
      if (crowd_.meets[body]) {
        bounce_body(body);
      }
    }
    return some;
  }

  // One block after the other; the next one sees what the wall did.
  void bounce_body(int body) {
    const int lowest = crowd_.order[crowd_.first(body)], lane = lowest % lanes;
    const Member<Real>& own = members_[lowest / lanes];
    const Axes<T> axes = one_lane(own.axes, lane);
    Pose<T> pose = one_lane(own.pose, lane);
    Motion<T> motion = one_lane(own.motion, lane);
    for (int i = crowd_.first(body); i < crowd_.end[body]; ++i) {
      const Arm<T> arm = one_lane(member(i).arm, lane_of_member(i));
      const Axes<T> at_wall = own_axes(axes, i);
      meet_wall(
          wall_, h_, T(get(own.per_inertia, lane)), arm, [&](T) { return at_wall; }, pose, motion);
    }
    for (int i = crowd_.first(body); i < crowd_.end[body]; ++i) {
      Member<Real>& m = member(i);
      const int at = lane_of_member(i);
      put_place(m, at, pose);
      put(m.motion.vx, at, motion.vx);
      put(m.motion.vy, at, motion.vy);
      put(m.motion.omega, at, motion.omega);
      put_rest(m.drag, at);
    }
  }

  // One corner's way inward can lead another block of the assembly outward: go round until none is
  // outside.
  void push_inside() {
    constexpr int most_rounds = 16;
    constexpr T tolerance = T(1e-6);
    for (int round = 0; round < most_rounds; ++round) {
      bool moved = false;
      forget_bodies();
      for (int row = 0; row < rows_; ++row) {
        Member<Real>& m = members_[row];
        if (is_clear(m)) {
          continue;
        }
        Pose<Real> pose = m.pose;
        const auto outside = push(tolerance, axes_at_wall(h_, m.axes, m), m.arm, pose);
        if (!any(outside)) {
          continue;
        }
        moved = true;
        const auto joined = outside & (m.per_count < Real(T(0.75)));
        m.pose.x = select(joined, m.pose.x, pose.x);
        m.pose.y = select(joined, m.pose.y, pose.y);
        forget_drag(outside, m);
        note_bodies(joined, m);
      }
      for (int body = 0; moved && body < crowd_.bodies; ++body) {
        if (crowd_.meets[body]) {
          push_body(body, tolerance);
        }
      }
      if (!moved) {
        return;
      }
    }
    take_back_jammed_members();
  }

  void push_body(int body, T tolerance) {
    const int lowest = crowd_.order[crowd_.first(body)], lane = lowest % lanes;
    const Axes<T> axes = one_lane(members_[lowest / lanes].axes, lane);
    Pose<T> pose = one_lane(members_[lowest / lanes].pose, lane);
    for (int i = crowd_.first(body); i < crowd_.end[body]; ++i) {
      const Arm<T> arm = one_lane(member(i).arm, lane_of_member(i));
      push_member<T, T>(wall_, h_, tolerance, true, own_axes(axes, i), arm, pose);
    }
    for (int i = crowd_.first(body); i < crowd_.end[body]; ++i) {
      put_place(member(i), lane_of_member(i), pose);
      put_rest(member(i).drag, lane_of_member(i));
    }
  }

  // What spans the tank and has turned into its walls: it has not moved in this step.
  void take_back_jammed_members() {
    constexpr T tolerance = T(1e-4);
    for (int b = 0; b < rows_ * lanes; ++b) {
      Member<Real>& m = members_[b / lanes];
      const int lane = b % lanes;
      Pose<T> pushed = one_lane(m.pose, lane);
      if (!push_member<T, T>(wall_, h_, tolerance, true,
                             one_lane(axes_at_wall(h_, m.axes, m), lane), one_lane(m.arm, lane),
                             pushed)) {
        continue;
      }
      const int root = get(m.root, lane);
      for (int other = root; other < rows_ * lanes; ++other) {
        if (get(members_[other / lanes].root, other % lanes) == root) {
          take_back_member(members_[other / lanes], other % lanes);
        }
      }
    }
  }

  Bool push(T tolerance, const Axes<Real>& axes, const Arm<Real>& arm, Pose<Real>& pose) const {
    const auto everywhere = Real(T(0)) < Real(T(1));
    return push_member<Real, T>(wall_, h_, tolerance, everywhere, axes, arm, pose);
  }
  // Whether a row is within a circular wall whatever its angles.
  bool is_clear(const Member<Real>& m) const {
    const T inner = max(wall_.radius - reach_of(h_), T(0));
    const Real x = m.pose.x + m.arm.x, y = m.pose.y + m.arm.y;
    return wall_.radius > T(0) && !any(x * x + y * y > Real(inner * inner));
  }

  void forget_bodies() {
    for (int body = 0; body < crowd_.bodies; ++body) {
      crowd_.meets[body] = 0;
    }
  }
  void note_bodies(Bool joined, const Member<Real>& m) {
    for (int lane = 0; lane < lanes && any(joined); ++lane) {
      if (lane_of(joined, lane)) {
        crowd_.meets[crowd_.body[get(m.root, lane)]] = 1;
      }
    }
  }
  Member<Real>& member(int i) const { return members_[crowd_.order[i] / lanes]; }
  // The axes of a member of an assembly with these axes.
  Axes<T> own_axes(const Axes<T>& axes, int i) const {
    if constexpr (std::is_same_v<Half, Box<T>>) {
      return turned_axes(axes, one_lane(member(i).turn, lane_of_member(i)));
    } else {
      return axes;
    }
  }
  int lane_of_member(int i) const { return crowd_.order[i] % lanes; }
  static void put_place(Member<Real>& m, int lane, const Pose<T>& pose) {
    put(m.pose.x, lane, pose.x);
    put(m.pose.y, lane, pose.y);
  }

  const WallView<T>& wall_;
  Half h_;
  Member<Real>* members_;
  Crowd<Real>& crowd_;
  int rows_;
};

template <class Real, class T, class Law>
inline void meet_walls(const Physics<Real, T, Law>& physics, Member<Real>* members,
                       Crowd<Real>& crowd, int rows) {
  with_half(physics.block, physics.shape, [&]<class Half>(const Half& half) {
    CrowdAtWalls<Real, T, Half>(physics.wall, half, members, crowd, rows).meet();
  });
}

// The axes of a block in a lane: of a rectangle its own.
template <class Real, class T>
inline Axes<T> near_axes(const NearRules<T>& rules, const Member<Real>& m, int lane) {
  const Axes<T> axes = one_lane(m.axes, lane);
  return rules.half_width > T(0) ? turned_axes(axes, one_lane(m.turn, lane)) : axes;
}

// Whether a pair of the list overlaps or may latch.
template <class Real, class T>
inline bool is_to_settle(const NearRules<T>& rules, const Member<Real>* members,
                         const Crowd<Real>& crowd, const PairList& pairs) {
  constexpr int lanes = Numbers<Real>::lanes;
  const T* const x = reinterpret_cast<const T*>(crowd.x);
  const T* const y = reinterpret_cast<const T*>(crowd.y);
  for (int k = 0; k < pairs.count; ++k) {
    const int first = pairs.pair[k].first, second = pairs.pair[k].second;
    const T dx = x[second] - x[first], dy = y[second] - y[first];
    if (!(dx * dx + dy * dy < rules.reach * rules.reach)) {
      continue;
    }
    const Axes<T> a = near_axes(rules, members[first / lanes], first % lanes);
    const Axes<T> b = near_axes(rules, members[second / lanes], second % lanes);
    if (may_meet<T, T>(rules, dx, dy, a, b)) {
      return true;
    }
  }
  return false;
}

DRIFTWALK_LANES_END
