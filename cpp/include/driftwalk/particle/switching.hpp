// A particle that swims along its heading and switches between states.
//
//   dx = (v e(phi) + u) dt + sqrt(2 D_t) dW,   dphi = Omega dt + sqrt(2 D_r) dW + wall
//
// The speed v relaxes to that of the bout, times a slow factor exp(m - var/2), times a stroke
// 1 + s cos(2 pi f t). Near the wall, with w = exp(-d / range) and psi the angle between the
// outward normal and the heading, it turns at (away (1 - d / gap) sin(psi) + along sin(2 psi)) w,
// and loses the share `slowing` w of its speed. How others push it off: neighbours.hpp.
#pragma once

#include "driftwalk/flow/bilinear.hpp"
#include "driftwalk/particle/bout.hpp"
#include "driftwalk/particle/enclosure.hpp"
#include "driftwalk/particle/neighbours.hpp"

DRIFTWALK_LANES_BEGIN

// The water's velocity [m/s] at points of the arena.
template <class Real, class T>
inline void water_at(const FlowView<T>& flow, Real x, Real y, Real& u, Real& v) {
  const Real inside_x = clamp_to(x, flow.low_x, flow.high_x);
  const Real inside_y = clamp_to(y, flow.low_y, flow.high_y);
  const Real still{T(0)};
  const FlowCursor<Real> cursor(flow, (inside_x - flow.origin_x) * flow.per_spacing_x,
                                (inside_y - flow.origin_y) * flow.per_spacing_y, still, still);
  cursor.read(u, v);
  u = u * flow.unit;
  v = v * flow.unit;
}

template <class Real>
class SwitchingParticle {
public:
  using T = typename Numbers<Real>::Scalar;
  using Bool = typename Numbers<Real>::Bool;

  SwitchingParticle(const ColumnReader<Real>& columns, const BatchWorlds& worlds, double step)
      : states_(read_states(columns, worlds.particle.states, step)), stream_(columns.stream()),
        neighbours_(columns, worlds.particle.neighbours), contact_(worlds.particle.contact),
        carried_(worlds.particle.carried), dt_(static_cast<T>(step)), x_(columns.of(worlds.x)),
        y_(columns.of(worlds.y)) {
    const Real zero{T(0)};
    clearance_ = columns(column_clearance);
    spread_ = sqrt(columns(column_diffusion) * (T(2) * dt_));
    slow_std_ = columns(column_slow_std);
    slow_kept_ = kept_over(dt_, columns(column_slow_time));
    slow_fresh_ = fresh_with(slow_kept_);
    stroke_ = columns(column_stroke);
    stroke_turns_ = columns(column_stroke_frequency) * dt_;
    wall_turn_ = columns(column_wall_turn);
    wall_follow_ = columns(column_wall_follow);
    wall_slowing_ = columns(column_wall_slowing);
    per_wall_range_ = Real(T(1)) / max(columns(column_wall_range), Real(T(1e-6)));
    const Real gap = columns(column_wall_gap);
    per_wall_gap_ = select(gap > zero, Real(T(1)) / max(gap, Real(T(1e-6))), zero);
    slow_ = any(slow_std_ > zero);
    strokes_ = any(abs(stroke_) > zero);
    feels_wall_ =
        any(abs(wall_turn_) > zero) || any(abs(wall_follow_) > zero) || any(wall_slowing_ > zero);
    const Axes<Real> heading = axes_at(without_turns(columns.of(worlds.theta)));
    ahead_x_ = heading.cosine;
    ahead_y_ = heading.sine;
    from_x_ = ahead_x_;
    from_y_ = ahead_y_;
    start();
  }

  void step(const WallView<T>& wall, const FlowView<T>& flow, std::int64_t index) {
    Real normal[4];
    draw_normals(stream_, Purpose::motion, index, normal);
    const T slack = (flow.high_x - flow.low_x) * static_cast<T>(contact_slack);
    bout_.left = bout_.left - dt_;
    const Bool ended = bout_.left <= Real(T(0));
    if (any(ended)) {
      change_bout(index, ended);
    }
    from_x_ = ahead_x_;
    from_y_ = ahead_y_;
    const Real off = speed_ - bout_.target;
    Real speed = (bout_.target + off * bout_.mean) * (factor(normal[1]) * bout_.straight);
    speed_ = bout_.target + off * bout_.kept;
    Real turn = bout_.turn_rate * dt_ + bout_.turn_noise * normal[0];
    if (feels_wall_) {
      feel_wall(wall, speed, turn);
    }
    Real u{T(0)}, v{T(0)};
    if (carried_) {
      water_at(flow, x_, y_, u, v);
    }
    if (neighbours_.felt()) {
      neighbours_.push_off(index, x_, y_, speed, u, v);
    }
    // It moves along the heading in the middle of the step, at the mean speed within it.
    Real sine, cosine;
    sincos(bounded_angle(turn * T(0.5)), sine, cosine);
    rotate(cosine, sine);
    const Real from_x = x_, from_y = y_;
    x_ = x_ + (speed * ahead_x_ + u) * dt_ + spread_ * normal[2];
    y_ = y_ + (speed * ahead_y_ + v) * dt_ + spread_ * normal[3];
    rotate(cosine, sine);
    stay_inside(wall, slack, clearance_, contact_, from_x, from_y, x_, y_,
                [&](const NearestWall<Real>& nearest, Bool touched) {
                  if (contact_ == WallContact::reflect) {
                    mirror(nearest, touched, ahead_x_, ahead_y_);
                  }
                });
    keep_unit_length();
  }

  Real x() const { return x_; }
  Real y() const { return y_; }
  // The heading at a share of the last step.
  Real ahead_x(T share) const { return from_x_ + (ahead_x_ - from_x_) * share; }
  Real ahead_y(T share) const { return from_y_ + (ahead_y_ - from_y_) * share; }
  const Philox<typename Numbers<Real>::UInt>& stream() const { return stream_; }

private:
  // The first bout: in the state that the shares say, at that state's speed. Its draws stand where
  // no step's do.
  void start() {
    constexpr std::int64_t before = std::int64_t(1) << 62;
    const Real zero{T(0)};
    bout_ = {zero, zero, zero, zero, zero, zero, zero, zero};
    Real uniform[4], normal[4];
    draw_uniforms(stream_, Purpose::bout, before, uniform);
    draw_normals(stream_, Purpose::motion, before, normal);
    const Real number =
        pick_state(states_.count, uniform[0], [&](int k) { return states_.state[k].start_share; });
    const Entry<Real> entry =
        begin_bout(states_, stream_, before, zero <= zero, number, uniform, bout_);
    speed_ = entry.speed;
    slow_number_ = normal[0];
    phase_ = uniform[3] - T(0.5);
  }

  void change_bout(std::int64_t index, Bool ended) {
    Real uniform[4];
    draw_uniforms(stream_, Purpose::bout, index, uniform);
    const Real number = next_state(states_, bout_.state, uniform[0]);
    const Entry<Real> entry = begin_bout(states_, stream_, index, ended, number, uniform, bout_);
    speed_ = select(entry.kicked, entry.speed, speed_);
    Real sine, cosine;
    sincos(entry.turn, sine, cosine);
    rotate(cosine, sine);
    ahead_x_ = select(entry.reversed, -ahead_x_, ahead_x_);
    ahead_y_ = select(entry.reversed, -ahead_y_, ahead_y_);
  }

  // Of the speed: the slow changes, and the stroke.
  Real factor(Real normal) {
    Real found{T(1)};
    if (slow_) {
      slow_number_ = slow_kept_ * slow_number_ + slow_fresh_ * normal;
      found = bounded_exp(slow_std_ * (slow_number_ - slow_std_ * T(0.5)));
    }
    if (strokes_) {
      phase_ = part_of_turn(phase_ + stroke_turns_);
      const Axes<Real> swing = axes_at(phase_ * static_cast<T>(2 * pi_value));
      found = found * (Real(T(1)) + stroke_ * swing.cosine);
    }
    return found;
  }

  void feel_wall(const WallView<T>& wall, Real& speed, Real& turn) const {
    const NearestWall<Real> nearest = nearest_wall(wall, clearance_, x_, y_);
    const Real away = min(-nearest.distance * per_wall_range_, Real(T(0)));
    // Farther off than 12 ranges a particle feels no wall, whoever else is in the pack.
    const Bool near = away > Real(T(-12));
    if (!any(near)) {
      return;
    }
    const Real strength = select(near, bounded_exp(away), Real(T(0)));
    const Real across = nearest.nx * ahead_y_ - nearest.ny * ahead_x_;
    const Real along = nearest.nx * ahead_x_ + nearest.ny * ahead_y_;
    // Without a gap the factor is exactly 1.
    const Real gaps = max(nearest.distance, Real(T(0))) * per_wall_gap_;
    const Real turn_here = wall_turn_ * (Real(T(1)) - gaps);
    const Real rate = across * (turn_here + wall_follow_ * along * T(2));
    turn = turn + rate * strength * dt_;
    speed = speed * (Real(T(1)) - wall_slowing_ * strength);
  }

  void rotate(Real cosine, Real sine) {
    const Real x = ahead_x_ * cosine - ahead_y_ * sine;
    ahead_y_ = ahead_x_ * sine + ahead_y_ * cosine;
    ahead_x_ = x;
  }

  // A step of Newton's for 1 / sqrt: rounding does not add up.
  void keep_unit_length() {
    const Real scale = Real(T(1.5)) - (ahead_x_ * ahead_x_ + ahead_y_ * ahead_y_) * T(0.5);
    ahead_x_ = ahead_x_ * scale;
    ahead_y_ = ahead_y_ * scale;
  }

  States<Real> states_;
  Philox<typename Numbers<Real>::UInt> stream_;
  Neighbours<Real> neighbours_;
  WallContact contact_;
  bool carried_, slow_, strokes_, feels_wall_;
  T dt_;
  Real x_, y_;
  Real clearance_, spread_, slow_std_, slow_kept_, slow_fresh_, stroke_, stroke_turns_;
  Real wall_turn_, wall_follow_, wall_slowing_, per_wall_range_, per_wall_gap_;
  Real ahead_x_, ahead_y_; // the heading, a unit vector
  Real from_x_, from_y_;   // the same when the last step began
  Real speed_, slow_number_, phase_;
  Bout<Real> bout_;
};

DRIFTWALK_LANES_END
