// The innovations filter on one instruction set: an extended Kalman filter on the samples of a
// track, of (x, y, vx, vy) with the angle an input, or of (x, y, theta, vx, vy, omega). With F = 2
// the force on the centre remembers, and its acceleration is a part of the state too.
//
// Between samples the state goes in equal steps not above the largest one, each a half drift, a
// kick by the mean drag over the covariance at its middle, and a half drift.
#pragma once

#include "driftwalk/infer/expected_drag.hpp"
#include "driftwalk/infer/flow_layers.hpp"
#include "driftwalk/infer/kalman.hpp"
#include "driftwalk/infer/products.hpp"
#include "driftwalk/infer/sensitivity.hpp"
#include "driftwalk/infer/water_acceleration.hpp"

DRIFTWALK_LANES_BEGIN

// Speed that a block may have where nothing is known of its velocity, and that a wall may have
// given it: the sd of either component [m/s].
inline constexpr double unknown_speed = 0.1;
// An innovation of a larger chi squared (2 degrees of freedom: one in 5e8, 3: one in 1e8) is no
// noise.
inline constexpr double outlier_chi_squared = 40;
// So many of them in a row are mistakes of the tracker, and the block is where it was predicted;
// one more, and the block has jumped. Of samples that are wrong one time in twenty, three in a row
// are wrong once in 8,000.
inline constexpr int most_outliers = 2;
// A missing angle counts as one that is known so badly that nothing follows from it [rad^2].
inline constexpr double variance_of_nothing = 1e12;
inline constexpr double full_turn = 6.283185307179586;

template <int D, int F, DragLawWithMoments Law>
class FilterRun {
public:
  // With sums derivatives are added up there instead of handed out.
  FilterRun(const Law& law, const FilterProblem& problem, FilterState<D, F>& state,
            const FilterScratch<D>& scratch, const FilterOutputs& out, const ProductSums* sums)
      : law_(law), problem_(problem), track_(problem.track), state_(state), scratch_(scratch),
        out_(out), sensitivity_(scratch), sums_(sums),
        products_(sums == nullptr ? ProductSums{} : *sums, scratch.stride) {}

  void run(std::int64_t count) {
    for (std::int64_t row = 0; row < count; ++row) {
      step(row);
      ++state_.next;
      if (with_sensitivities() && state_.next % samples_between_forgetting == 0) {
        sensitivity_.forget();
      }
    }
    if (sums_ != nullptr) {
      products_.flush();
    }
  }

private:
  bool with_sensitivities() const { return scratch_.shares != nullptr; }

  struct Sample {
    double value[D], variance[D];
    bool there; // the position
    bool whole; // the angle too, if it is part of it
  };

  Sample sample(std::int64_t k) const {
    const double x = track_.x[k], y = track_.y[k];
    Sample sample{{x, y}, {problem_.variance[0], problem_.variance[1]}, x == x && y == y, false};
    sample.whole = sample.there;
    if constexpr (D == 3) {
      const double theta = track_.theta[k];
      const bool seen = theta == theta;
      sample.whole = sample.there && seen;
      sample.variance[2] = seen ? problem_.variance[2] : variance_of_nothing;
      sample.value[2] = seen && state_.open ? next_to(theta, state_.mean[2])
                        : seen              ? theta
                                            : state_.mean[2];
    }
    return sample;
  }

  static double next_to(double angle, double other) {
    return angle - full_turn * __builtin_rint((angle - other) / full_turn);
  }

  void step(std::int64_t row) {
    const std::int64_t k = state_.next;
    if (state_.open && track_.time[k] - state_.seen > problem_.longest_gap) {
      state_.open = false;
      state_.restarted = true;
    }
    if (out_.errors != nullptr) {
      for (int a = 0; a < size; ++a) {
        for (int b = 0; b < size; ++b) {
          transition_[a][b] = state_.open && a == b ? 1 : 0;
        }
      }
    }
    if (state_.open) {
      predict(k);
    }
    write_errors(row, 1, state_.covariance);
    const Sample found = sample(k);
    if (state_.open && found.there) {
      take_sample(row, k, found);
    } else {
      write_nothing(row);
    }
    // A contact within the last interval may have displaced the block, too.
    const double* prior =
        track_.velocity_prior == nullptr ? nullptr : track_.velocity_prior + 6 * k;
    const bool expected = prior != nullptr && prior[0] == prior[0];
    if (found.whole && (!state_.open || (expected && track_.excluded[k] != 0))) {
      const double still[D] = {};
      open(found, still);
      if (expected) {
        take_velocity_prior(prior);
      }
    }
    if (found.there) {
      state_.seen = track_.time[k];
    }
    write_state(row);
    write_errors(row, 0, transition_);
    write_errors(row, 2, state_.covariance);
  }

  double unknown_velocity(int a) const {
    return a < 2 ? unknown_speed : unknown_speed / problem_.block.half_side;
  }

  void open(const Sample& found, const double* velocity) {
    state_ = {{}, {}, state_.seen, true, 0, state_.next, state_.restarted, 0};
    for (int a = 0; a < D; ++a) {
      state_.mean[a] = found.value[a];
      state_.mean[a + D] = velocity[a];
      state_.covariance[a][a] = problem_.variance[a];
      state_.covariance[a + D][a + D] = unknown_velocity(a) * unknown_velocity(a);
    }
    if constexpr (F == 2) {
      for (int f = 2 * D; f < 2 * D + 2; ++f) {
        state_.covariance[f][f] = problem_.intensity[0] / (2 * problem_.force_memory);
      }
    }
    __builtin_memset(transition_, 0, sizeof transition_);
    if (with_sensitivities()) {
      sensitivity_.clear();
    }
  }

  void take_velocity_prior(const double* prior) {
    for (int a = 0; a < D; ++a) {
      state_.mean[a + D] = prior[a];
      state_.covariance[a + D][a + D] = prior[a + 3] * prior[a + 3];
    }
  }

  void predict(std::int64_t k) {
    const double interval = track_.time[k] - track_.time[k - 1];
    if (state_.undragged > 0) {
      make_up_for_drag(k);
    }
    const double wanted = __builtin_ceil(interval / problem_.largest_step - 1e-9);
    const int steps = wanted > 1 ? static_cast<int>(wanted) : 1;
    const double h = interval / steps;
    for (int i = 0; i < steps; ++i) {
      // The second half drift of a step and the first of the next are one pass of sensitivities.
      advance(h, k, (i + 0.5) / steps, i == 0 ? h / 2 : h);
    }
    if (with_sensitivities()) {
      sensitivity_.drift(h / 2);
    }
    if (track_.excluded[k] != 0) {
      for (int a = 0; a < D; ++a) {
        state_.covariance[a + D][a + D] += unknown_velocity(a) * unknown_velocity(a);
      }
      state_.restarted = true;
    }
  }

  // Two samples give the velocity between them. From there to the second the drag acts, too.
  void make_up_for_drag(std::int64_t k) {
    Square<2 * D> covariance;
    copy_motion_covariance(covariance);
    const double h = state_.undragged;
    const DragResponse<D> drag = response_at(covariance, k, 0);
    const Kick<D> kick = make_kick(drag, h);
    for (int a = 0; a < D; ++a) {
      state_.mean[a + D] += kick.change[a];
    }
    kick_covariance(state_, kick);
    if (out_.errors != nullptr) {
      carry_errors(kick, 0);
    }
    if (with_sensitivities()) {
      sensitivity_.drift_and_kick(0, kick);
      sensitivity_.add_flow(scratch_, drag, problem_.flow.columns, kick, h);
    }
    state_.undragged = 0;
  }

  // A step h; `share` says where its middle is between the samples k - 1 and k.
  void advance(double h, std::int64_t k, double share, double sensitivity_drift) {
    drift_mean(state_, h / 2);
    drift_covariance(state_, h / 2);
    Square<2 * D> middle;
    copy_motion_covariance(middle);
    for (int a = 0; a < D; ++a) {
      middle[a + D][a + D] += white_intensity(a) * h / 2;
    }
    if constexpr (F == 2) {
      add_half_push(middle, h / 2);
    }
    // Of any velocity the mean drag is far too large. Until a sample gives one, nothing drags.
    const DragResponse<D> drag =
        state_.restarted ? DragResponse<D>{} : response_at(middle, k, share);
    Kick<D> kick = make_kick(drag, h);
    for (int a = 0; a < D; ++a) {
      state_.mean[a + D] += kick.change[a];
    }
    if constexpr (F == 2) {
      remember(kick, h);
    }
    drift_mean(state_, h / 2);
    kick_covariance(state_, kick);
    drift_covariance(state_, h / 2);
    if (out_.errors != nullptr) {
      carry_errors(kick, h);
    }
    // What the drag's bend adds stays about the same from one sample to the next.
    Square<D> intensity;
    bend_covariance<D>(drag, middle, intensity);
    const double interval = track_.time[k] - track_.time[k - 1];
    for (int a = 0; a < D; ++a) {
      for (int b = 0; b < D; ++b) {
        intensity[a][b] *= interval;
      }
      intensity[a][a] += white_intensity(a);
    }
    add_noise<D>(state_, kick.inverse, intensity, h);
    if constexpr (F == 2) {
      add_memory_noise<D>(state_, kick.inverse, problem_.intensity[0], h, problem_.force_memory);
    }
    if (with_sensitivities()) {
      sensitivity_.drift_and_kick(sensitivity_drift, kick);
      sensitivity_.add_flow(scratch_, drag, problem_.flow.columns, kick, h);
    }
  }

  // Of the coordinates and velocities, without a force that remembers.
  void copy_motion_covariance(Square<2 * D>& covariance) const {
    for (int a = 0; a < 2 * D; ++a) {
      for (int b = 0; b < 2 * D; ++b) {
        covariance[a][b] = state_.covariance[a][b];
      }
    }
  }

  // Takes the transition of the state's error through a step.
  void carry_errors(const Kick<D>& kick, double h) {
    for (int b = 0; b < size; ++b) {
      const auto drift = [&] {
        for (int a = 0; a < D; ++a) {
          transition_[a][b] += h / 2 * transition_[a + D][b];
        }
      };
      drift();
      kick_line<D, F>(kick, [&](int a) -> double& { return transition_[a][b]; });
      drift();
    }
  }

  // Of what has no memory.
  double white_intensity(int a) const { return F == 2 && a < 2 ? 0 : problem_.intensity[a]; }

  // What the remembered force does to the velocities' covariance in a time h.
  void add_half_push(Square<2 * D>& covariance, double h) const {
    const double memory = problem_.force_memory;
    const double time = memory * (1 - __builtin_exp(-h / memory));
    const Square<2 * D + F>& P = state_.covariance;
    for (int a = 0; a < 2; ++a) {
      for (int b = 0; b < 2; ++b) {
        covariance[a + D][b + D] += time * (P[a + D][b + 2 * D] + P[a + 2 * D][b + D]) +
                                    time * time * P[a + 2 * D][b + 2 * D];
      }
      covariance[a + D][a + D] += problem_.intensity[0] * memory_noise(h, memory).vv;
    }
  }

  // Takes the mean through what the remembered force does in a step, and completes the kick.
  void remember(Kick<D>& kick, double h) {
    const double memory = problem_.force_memory;
    kick.force_kept = __builtin_exp(-h / memory);
    kick.force_time = memory * (1 - kick.force_kept);
    kick.force_lag = memory * (h - kick.force_time) - h / 2 * kick.force_time;
    double force[2], coordinates[D], velocities[D];
    for (int f = 0; f < 2; ++f) {
      force[f] = state_.mean[2 * D + f];
      state_.mean[2 * D + f] *= kick.force_kept;
    }
    for (int a = 0; a < D; ++a) {
      coordinates[a] = state_.mean[a];
      velocities[a] = state_.mean[a + D];
    }
    push_linear<D, double>(kick, force, coordinates, velocities);
    for (int a = 0; a < D; ++a) {
      state_.mean[a] = coordinates[a];
      state_.mean[a + D] = velocities[a];
    }
  }

  DragResponse<D> response_at(const Square<2 * D>& covariance, std::int64_t k, double share) const {
    UncertainBlock<D> block{state_.mean[0], state_.mean[1], state_.mean[D], state_.mean[D + 1], 0,
                            covariance};
    SplineView flow = problem_.flow;
    const double* rate_nodes = nullptr;
    if (flow.layers > 1) {
      layer_strengths(track_, flow.layers, k, share, scratch_.weight, scratch_.weight_rate);
      const NodesNear near = nodes_near(flow, block.x, block.y, reach_);
      sum_layers(flow, near, scratch_.weight, scratch_.sum);
      if (pushed_) {
        sum_layers(flow, near, scratch_.weight_rate, scratch_.sum_rate);
        rate_nodes = scratch_.sum_rate;
      }
      flow.nodes = scratch_.sum;
    } else if (track_.strength != nullptr) {
      layer_strengths(track_, 1, k, share, &block.strength, &block.strength_rate);
    }
    double theta;
    if constexpr (D == 3) {
      theta = state_.mean[2];
      block.omega = state_.mean[5];
    } else {
      const double *angle = track_.theta + k, *spin = track_.omega + k;
      theta = angle[-1] + (angle[0] - angle[-1]) * share;
      block.omega = spin[-1] + (spin[0] - spin[-1]) * share;
    }
    DragResponse<D> response =
        expected_drag<D>(law_, problem_.law.power, flow, problem_.block, problem_.orientations,
                         theta, block, scratch_.shares);
    if (pushed_) {
      // Where the angle is not known, that of the tank's axes stands for all.
      const double known = problem_.orientations.count == 0 ? theta : 0;
      add_water_acceleration<D>(flow, rate_nodes, problem_.block, problem_.law,
                                __builtin_cos(known), __builtin_sin(known), block, scratch_.points,
                                response);
    }
    return response;
  }

  void take_sample(std::int64_t row, std::int64_t k, const Sample& found) {
    const bool excluded = track_.excluded[k] != 0;
    const Innovation<D> e =
        innovation_of(state_, found.value, found.variance, problem_.time_variance);
    const bool fits = e.chi_squared() < outlier_chi_squared;
    write_innovation(row, e);
    // The first innovation after a gap or a contact tells of the velocity at its end alone, of
    // which no law is assumed: counted, it would ask for the drag that makes any velocity the
    // water's.
    write_likelihood(row, fits && !excluded && !state_.restarted ? &e : nullptr);
    if (!fits && !excluded) {
      if (++state_.outliers <= most_outliers) {
        return;
      }
      double velocity[D];
      bool finite = true;
      for (int a = 0; a < D; ++a) {
        velocity[a] = state_.mean[a + D];
        finite = finite && __builtin_isfinite(velocity[a]);
      }
      for (double& value : velocity) {
        value = finite ? value : 0;
      }
      open(found, velocity);
      return;
    }
    state_.outliers = 0;
    if (state_.restarted && !excluded) {
      state_.restarted = false;
      state_.undragged = (track_.time[k] - state_.seen) / 2;
    }
    const Gain<D, F> gain = gain_of(state_, e);
    update(state_, e, gain);
    if (with_sensitivities()) {
      sensitivity_.update(gain);
    }
  }

  // What a row says unless its sample has an innovation.
  void write_nothing(std::int64_t row) {
    Innovation<D> nothing;
    for (int a = 0; a < D; ++a) {
      nothing.e[a] = __builtin_nan("");
      for (int b = 0; b < D; ++b) {
        nothing.S[a][b] = __builtin_nan("");
      }
    }
    write_innovation(row, nothing);
    write_likelihood(row, nullptr);
  }

  void write_innovation(std::int64_t row, const Innovation<D>& e) {
    double* covariance = out_.covariance + row * (D * (D + 1) / 2);
    for (int a = 0; a < D; ++a) {
      out_.innovation[D * row + a] = e.e[a];
      for (int b = 0; b <= a; ++b) {
        *covariance++ = e.S[a][b];
      }
    }
  }

  // The innovation's part in the likelihood; null where it has none.
  void write_likelihood(std::int64_t row, const Innovation<D>* e) {
    out_.used[row] = e != nullptr ? 1 : 0;
    if (sums_ != nullptr) {
      add_products(e);
    } else if (with_sensitivities()) {
      write_derivatives(row, e);
    }
  }

  void add_products(const Innovation<D>* e) {
    const std::int64_t k = state_.next - sums_->first;
    if (e == nullptr || (sums_->kept != nullptr && sums_->kept[k] == 0)) {
      return;
    }
    sensitivity_.write_whitened(
        *e, [&](int a, std::int32_t group) { return products_.place(a, group); });
    products_.add(D, sums_->right == nullptr ? e->white : sums_->right + k * D * sums_->columns);
  }

  void write_derivatives(std::int64_t row, const Innovation<D>* e) {
    const auto bytes = sizeof(double) * std::size_t(scratch_.parameters);
    double* const whitened = out_.whitened + D * row;
    double* const jacobian = out_.jacobian + D * (row / out_.pooled) * scratch_.parameters;
    for (int a = 0; a < D; ++a) {
      whitened[a] = e == nullptr ? 0 : e->white[a];
    }
    if (e == nullptr) {
      if (out_.pooled == 1) {
        __builtin_memset(jacobian, 0, D * bytes);
      }
      return;
    }
    if (out_.pooled == 1) {
      __builtin_memset(scratch_.row, 0, sizeof(double) * std::size_t(D * scratch_.stride));
    }
    sensitivity_.write_whitened(*e, [&](int a, std::int32_t group) {
      return scratch_.row + a * scratch_.stride + 8 * std::int64_t(group);
    });
    for (int a = 0; a < D; ++a) {
      double* const to = jacobian + a * scratch_.parameters;
      const double* const from = scratch_.row + a * scratch_.stride;
      if (out_.pooled == 1) {
        __builtin_memcpy(to, from, bytes);
      } else {
        sensitivity_.add_row(from, to);
      }
    }
  }

  void write_state(std::int64_t row) {
    if (out_.state == nullptr) {
      return;
    }
    for (int a = 0; a < 2 * D; ++a) {
      out_.state[2 * D * row + a] = state_.open ? state_.mean[a] : __builtin_nan("");
    }
  }

  void write_errors(std::int64_t row, int which, const Square<2 * D + F>& values) {
    if (out_.errors != nullptr) {
      __builtin_memcpy(out_.errors + (3 * row + which) * size * size, values, sizeof values);
    }
  }

  static constexpr int size = 2 * D + F;
  Square<2 * D + F> transition_{}; // of the state's error since the sample before
  [[no_unique_address]] Law law_;
  const FilterProblem& problem_;
  const Track& track_;
  FilterState<D, F>& state_;
  const FilterScratch<D>& scratch_;
  const FilterOutputs& out_;
  Sensitivity<D, F> sensitivity_;
  const ProductSums* sums_;
  Products products_;
  // Whether the water's acceleration pushes the block; how far it reaches, and somewhat further
  // [m].
  bool pushed_ = problem_.law.water_acceleration != 0 || problem_.law.water_spin != 0;
  double reach_ = problem_.block.reach;
};

DRIFTWALK_LANES_END
