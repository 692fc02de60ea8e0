// Bouts of a particle that switches between states: how long one lasts, and what is drawn for it.
//
// A bout's time has a Weibull law, scale * (-ln U)^(1/shape): one uniform number, exponential at
// shape 1, as regular as a clock at large shapes.
#pragma once

#include "driftwalk/particle/numbers.hpp"

DRIFTWALK_LANES_BEGIN

// A state's numbers, ready for drawing.
template <class Real>
struct State {
  Real dwell_scale, dwell_power, start_share;
  Real speed, speed_log_std, speed_kept, speed_mean, coasting;
  Real turn_noise; // of the heading in a step [rad]
  Real turn_rate, turn_rate_std, turn_std, reversal_share;
  Real next[most_particle_states];
};

template <class Real>
struct States {
  int count;
  State<Real> state[most_particle_states];
};

// What a particle does until its next bout.
template <class Real>
struct Bout {
  Real state;      // its number
  Real left;       // [s]
  Real target;     // the speed that it relaxes to [m/s]
  Real kept;       // of the difference to it, over a step
  Real mean;       // of the difference within a step, over that at its beginning
  Real turn_rate;  // [rad/s]
  Real turn_noise; // [rad]
  Real straight;   // way of a step over its length, for the heading wavers within it
};

// What the beginning of a bout does to the particle.
template <class Real>
struct Entry {
  Real turn;  // [rad]
  Real speed; // of the bout [m/s]
  typename Numbers<Real>::Bool reversed, kicked;
};

template <class Real>
inline States<Real> read_states(const ColumnReader<Real>& columns, int count, double step) {
  using T = typename Numbers<Real>::Scalar;
  const T dt = static_cast<T>(step);
  States<Real> states;
  states.count = count;
  for (int k = 0; k < count; ++k) {
    const int first = shared_columns + k * (state_columns + count);
    const auto number = [&](int column) { return columns(first + column); };
    State<Real>& state = states.state[k];
    state.dwell_scale = number(column_dwell_scale);
    state.dwell_power = number(column_dwell_power);
    state.start_share = number(column_start_share);
    state.speed = number(column_speed);
    state.speed_log_std = log_std_of(number(column_speed_cv));
    const Real relaxation = number(column_relaxation_time);
    state.speed_kept = kept_over(dt, relaxation);
    state.speed_mean = mean_over(dt, relaxation, state.speed_kept);
    state.coasting = number(column_coasting);
    state.turn_noise = sqrt(number(column_rotational_diffusion) * (T(2) * dt));
    state.turn_rate = number(column_turn_rate);
    state.turn_rate_std = number(column_turn_rate_std);
    state.turn_std = number(column_turn_std);
    state.reversal_share = number(column_reversal_share);
    for (int j = 0; j < count; ++j) {
      state.next[j] = number(state_columns + j);
    }
  }
  return states;
}

// The state that a uniform number picks, with these chances one after the other.
template <class Real, class Chance>
inline Real pick_state(int count, Real uniform, const Chance& chance) {
  using T = typename Numbers<Real>::Scalar;
  Real picked{T(0)}, below = chance(0);
  for (int k = 1; k < count; ++k) {
    picked = select(uniform > below, Real(static_cast<T>(k)), picked);
    below = below + chance(k);
  }
  return picked;
}

template <class Real>
inline Real next_state(const States<Real>& states, Real now, Real uniform) {
  using T = typename Numbers<Real>::Scalar;
  Real next = now;
  for (int k = 0; k < states.count; ++k) {
    const Real picked =
        pick_state(states.count, uniform, [&](int j) { return states.state[k].next[j]; });
    next = select(now == Real(static_cast<T>(k)), picked, next);
  }
  return next;
}

// The numbers of the state that each lane is in.
template <class Real>
inline State<Real> current(const States<Real>& states, Real number) {
  using T = typename Numbers<Real>::Scalar;
  State<Real> found = states.state[0];
  for (int k = 1; k < states.count; ++k) {
    const State<Real>& other = states.state[k];
    const auto here = number == Real(static_cast<T>(k));
    const auto take = [&](Real State<Real>::* field) {
      found.*field = select(here, other.*field, found.*field);
    };
    take(&State<Real>::dwell_scale);
    take(&State<Real>::dwell_power);
    take(&State<Real>::speed);
    take(&State<Real>::speed_log_std);
    take(&State<Real>::speed_kept);
    take(&State<Real>::speed_mean);
    take(&State<Real>::coasting);
    take(&State<Real>::turn_noise);
    take(&State<Real>::turn_rate);
    take(&State<Real>::turn_rate_std);
    take(&State<Real>::turn_std);
    take(&State<Real>::reversal_share);
  }
  return found;
}

// Begins a bout in the given state, where `where` holds. The numbers are drawn at `index`: of the
// uniform ones the first picked the state.
template <class Real>
inline Entry<Real> begin_bout(const States<Real>& states,
                              const Philox<typename Numbers<Real>::UInt>& stream,
                              std::int64_t index, typename Numbers<Real>::Bool where, Real number,
                              const Real* uniform, Bout<Real>& bout) {
  using T = typename Numbers<Real>::Scalar;
  const Real zero{T(0)};
  Real normal[4];
  draw_normals(stream, Purpose::bout, index, normal);
  const State<Real> state = current(states, number);
  const Real lasting = max(-log(uniform[1]), Real(T(1e-8)));
  const Real dwell = state.dwell_scale * bounded_exp(state.dwell_power * log(lasting));
  const Real log_std = state.speed_log_std;
  const Real speed = state.speed * bounded_exp(log_std * normal[0] - log_std * log_std * T(0.5));
  const auto coasts = state.coasting > zero;
  bout.state = select(where, number, bout.state);
  // A bout ends within a step; what was left of that step belongs to the next one.
  bout.left = select(where, bout.left + dwell, bout.left);
  bout.target = select(where, select(coasts, zero, speed), bout.target);
  bout.kept = select(where, state.speed_kept, bout.kept);
  bout.mean = select(where, state.speed_mean, bout.mean);
  bout.turn_rate = select(where, state.turn_rate + state.turn_rate_std * normal[2], bout.turn_rate);
  bout.turn_noise = select(where, state.turn_noise, bout.turn_noise);
  // The mean over a step of e(phi), given phi at both ends, is shorter than 1: half a third of the
  // noise's variance by the way in between, a twelfth by the chord. To first order, D dt / 4.
  const Real straight = bounded_exp(state.turn_noise * state.turn_noise * T(-0.125));
  bout.straight = select(where, straight, bout.straight);
  const typename Numbers<Real>::Bool reversed = where & (uniform[2] <= state.reversal_share);
  const typename Numbers<Real>::Bool kicked = where & coasts;
  return {select(where, without_turns(state.turn_std * normal[1]), zero), speed, reversed, kicked};
}

DRIFTWALK_LANES_END
