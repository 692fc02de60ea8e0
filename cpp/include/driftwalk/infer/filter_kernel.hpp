// The innovations filter on one instruction set: an extended Kalman filter of (x, y, vx, vy) on the
// samples of a track.
//
// Between samples the state goes in equal steps not above the largest one, each a half drift, a
// kick by the mean drag over the covariance at its middle, and a half drift.
#pragma once

#include "driftwalk/infer/expected_drag.hpp"
#include "driftwalk/infer/kalman.hpp"
#include "driftwalk/infer/sensitivity.hpp"

DRIFTWALK_LANES_BEGIN

// Speed that a block may have where nothing is known of its velocity, and that a wall may have
// given it: the sd of either component [m/s].
inline constexpr double unknown_speed = 0.1;
// An innovation of a larger chi squared (2 degrees of freedom; one in 5e8) is no noise.
inline constexpr double outlier_chi_squared = 40;

class FilterRun {
public:
  FilterRun(const FilterProblem& problem, FilterState& state, const FilterScratch& scratch,
            const FilterOutputs& out)
      : problem_(problem), track_(problem.track), state_(state), scratch_(scratch), out_(out),
        sensitivity_(scratch) {}

  void run(std::int64_t count) {
    for (std::int64_t row = 0; row < count; ++row) {
      step(row);
      ++state_.next;
    }
  }

private:
  bool with_sensitivities() const { return scratch_.shares != nullptr; }

  void step(std::int64_t row) {
    const std::int64_t k = state_.next;
    const double x = track_.x[k], y = track_.y[k];
    const bool there = x == x && y == y;
    if (state_.open && track_.time[k] - state_.seen > problem_.longest_gap) {
      state_.open = false;
    }
    if (state_.open) {
      predict(k);
    }
    if (state_.open && there) {
      take_sample(row, k, x, y);
    } else {
      write_nothing(row);
    }
    if (!state_.open && there) {
      open(x, y, 0, 0);
    }
    if (there) {
      state_.seen = track_.time[k];
    }
    write_state(row);
  }

  void open(double x, double y, double vx, double vy) {
    state_ = {{x, y, vx, vy}, {}, state_.seen, true, state_.next};
    for (int a = 0; a < 2; ++a) {
      state_.covariance[a][a] = problem_.position_variance;
      state_.covariance[a + 2][a + 2] = unknown_speed * unknown_speed;
    }
    if (with_sensitivities()) {
      sensitivity_.clear();
    }
  }

  void predict(std::int64_t k) {
    const double interval = track_.time[k] - track_.time[k - 1];
    const double wanted = __builtin_ceil(interval / problem_.largest_step - 1e-9);
    const int steps = wanted > 1 ? static_cast<int>(wanted) : 1;
    const double h = interval / steps;
    const double turn = track_.theta[k] - track_.theta[k - 1];
    const double spin = track_.omega[k] - track_.omega[k - 1];
    for (int i = 0; i < steps; ++i) {
      const double middle = (i + 0.5) / steps;
      // The second half drift of a step and the first of the next are one pass of sensitivities.
      advance(h, track_.theta[k - 1] + turn * middle, track_.omega[k - 1] + spin * middle,
              i == 0 ? h / 2 : h);
    }
    if (with_sensitivities()) {
      sensitivity_.drift(h / 2);
    }
    if (track_.excluded[k] != 0) {
      state_.covariance[2][2] += unknown_speed * unknown_speed;
      state_.covariance[3][3] += unknown_speed * unknown_speed;
    }
  }

  void advance(double h, double theta, double omega, double sensitivity_drift) {
    drift_mean(state_.mean, h / 2);
    drift_covariance(state_.covariance, h / 2);
    const DragResponse drag = drag_in_the_middle(h, theta, omega);
    const Kick kick = make_kick(drag, h);
    state_.mean[2] += kick.change[0];
    state_.mean[3] += kick.change[1];
    drift_mean(state_.mean, h / 2);
    kick_covariance(state_.covariance, kick);
    drift_covariance(state_.covariance, h / 2);
    add_noise(state_.covariance, kick.inverse, problem_.noise_intensity, h);
    if (with_sensitivities()) {
      sensitivity_.drift_and_kick(sensitivity_drift, kick);
      sensitivity_.add_flow(scratch_.shares, drag.shares, problem_.flow.columns, kick, h);
    }
  }

  DragResponse drag_in_the_middle(double h, double theta, double omega) const {
    double covariance[4][4];
    __builtin_memcpy(covariance, state_.covariance, sizeof covariance);
    covariance[2][2] += problem_.noise_intensity * h / 2;
    covariance[3][3] += problem_.noise_intensity * h / 2;
    const UncertainBlock block{state_.mean[0], state_.mean[1], state_.mean[2],
                               state_.mean[3], omega,          covariance};
    return expected_drag(problem_.flow, problem_.block, problem_.orientations, theta, block,
                         scratch_.shares);
  }

  void take_sample(std::int64_t row, std::int64_t k, double x, double y) {
    const bool excluded = track_.excluded[k] != 0;
    const Innovation e = innovation_of(state_, x, y, problem_.position_variance);
    const bool fits = e.chi_squared() < outlier_chi_squared;
    write_innovation(row, e);
    write_likelihood(row, fits && !excluded ? &e : nullptr);
    if (!fits && !excluded) {
      const double vx = state_.mean[2], vy = state_.mean[3];
      const bool finite = __builtin_isfinite(vx) && __builtin_isfinite(vy);
      open(x, y, finite ? vx : 0, finite ? vy : 0);
      return;
    }
    const Gain gain = gain_of(state_.covariance, e);
    update(state_, e, gain);
    if (with_sensitivities()) {
      sensitivity_.update(gain);
    }
  }

  // What a row says unless its sample has an innovation.
  void write_nothing(std::int64_t row) {
    const double nothing = __builtin_nan("");
    write_innovation(row, {nothing, nothing, nothing, nothing, nothing});
    write_likelihood(row, nullptr);
  }

  void write_innovation(std::int64_t row, const Innovation& e) {
    out_.innovation[2 * row] = e.x;
    out_.innovation[2 * row + 1] = e.y;
    out_.covariance[3 * row] = e.xx;
    out_.covariance[3 * row + 1] = e.xy;
    out_.covariance[3 * row + 2] = e.yy;
  }

  // The innovation's part in the likelihood; null where it has none.
  void write_likelihood(std::int64_t row, const Innovation* e) {
    out_.used[row] = e != nullptr ? 1 : 0;
    if (!with_sensitivities()) {
      return;
    }
    double* const whitened = out_.whitened + 2 * row;
    double* const row_x = out_.jacobian + 2 * row * scratch_.parameters;
    double* const row_y = row_x + scratch_.parameters;
    if (e == nullptr) {
      whitened[0] = whitened[1] = 0;
      __builtin_memset(row_x, 0, 2 * sizeof(double) * std::size_t(scratch_.parameters));
      return;
    }
    const Whitening whiten = whitening_of(*e);
    whitened[0] = e->x * whiten.per_xx;
    whitened[1] = (e->y - whiten.yx * whitened[0]) * whiten.per_yy;
    sensitivity_.write_whitened(whiten, row_x, row_y);
  }

  void write_state(std::int64_t row) {
    for (int a = 0; a < 4; ++a) {
      out_.state[4 * row + a] = state_.open ? state_.mean[a] : __builtin_nan("");
    }
  }

  const FilterProblem& problem_;
  const Track& track_;
  FilterState& state_;
  const FilterScratch& scratch_;
  const FilterOutputs& out_;
  Sensitivity sensitivity_;
};

DRIFTWALK_LANES_END
