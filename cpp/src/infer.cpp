#include "driftwalk/infer/innovations.hpp"

#include "driftwalk/dispatch.hpp"
#include "driftwalk/infer/lanes.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace driftwalk {

namespace {

void require(bool holds, const char* what) {
  if (!holds) {
    throw std::invalid_argument(what);
  }
}

bool positive(double value) {
  return std::isfinite(value) && value > 0;
}

bool all_finite(const double* values, std::int64_t count) {
  return std::all_of(values, values + count, [](double value) { return std::isfinite(value); });
}

void check(const Track& track, bool angle_known) {
  require(all_finite(track.time, track.samples), "times must be finite");
  require(std::adjacent_find(track.time, track.time + track.samples, std::greater_equal<>()) ==
              track.time + track.samples,
          "times must increase");
  for (std::int64_t k = 0; k < track.samples; ++k) {
    require(!std::isinf(track.x[k]) && !std::isinf(track.y[k]),
            "positions must be finite, or NaN where a sample is missing");
  }
  if (angle_known) {
    require(all_finite(track.theta, track.samples) && all_finite(track.omega, track.samples),
            "angles and their rates must be finite, missing samples included: interpolate them");
  }
}

} // namespace

InferKernel chosen_infer_kernel() {
#if defined(DRIFTWALK_X86_LANES)
  switch (chosen_instruction_set()) {
  case InstructionSet::avx512:
    return infer_kernel_avx512();
  case InstructionSet::avx2:
    return infer_kernel_avx2();
  case InstructionSet::baseline:
    break;
  }
#endif
  return infer_kernel_baseline();
}

DragModel::DragModel(const FloatingBlock& block, const SplineView& flow, const double* coefficients,
                     double drag_coefficient, bool angle_known)
    : flow_(flow), angle_known_(angle_known) {
  require(positive(block.side) && positive(block.mass) && positive(block.depth) &&
              positive(block.water_density),
          "side, mass, depth and water density must be positive");
  require(block.strips >= 1, "a side has at least one strip");
  require(positive(drag_coefficient), "the drag coefficient must be positive");
  require(positive(flow.spacing) && std::isfinite(flow.origin_x) && std::isfinite(flow.origin_y),
          "the flow's spacing must be positive and its origin finite");
  require(flow.rows >= 4 && flow.columns >= 4, "a bicubic flow needs at least 4 rows and columns");
  const std::int64_t nodes = std::int64_t(flow.rows) * flow.columns;
  require(all_finite(coefficients, 2 * nodes), "coefficients must be finite");
  nodes_.resize(std::size_t(2 * nodes));
  for (std::int64_t k = 0; k < nodes; ++k) {
    nodes_[std::size_t(2 * k)] = coefficients[k];
    nodes_[std::size_t(2 * k + 1)] = coefficients[nodes + k];
  }
  block_.half_side = block.side / 2;
  block_.strip_width = block.side / block.strips;
  block_.strips = block.strips;
  block_.drag_scale =
      0.5 * block.water_density * drag_coefficient * block_.strip_width * block.depth / block.mass;
  for (std::size_t k = 0; k < orientations; ++k) {
    const double angle = std::numbers::pi / 2 * double(k) / orientations;
    cosine_[k] = std::cos(angle);
    sine_[k] = std::sin(angle);
  }
}

FilterProblem DragModel::problem() const {
  FilterProblem problem{};
  problem.flow = flow_;
  problem.flow.nodes = nodes_.data();
  problem.block = block_;
  problem.orientations = {cosine_.data(), sine_.data(), angle_known_ ? 0 : orientations};
  return problem;
}

std::int64_t DragModel::shares() const {
  return std::int64_t(4) * block_.strips * (angle_known_ ? 1 : orientations);
}

DragResponse DragModel::drag(double theta, double omega, const double mean[4],
                             const double (*covariance)[4], double* by_coefficients) const {
  std::vector<StripShare> room(by_coefficients == nullptr ? 0 : std::size_t(shares()));
  return chosen_infer_kernel().drag(problem(), theta, omega, mean, covariance,
                                    room.empty() ? nullptr : room.data(), by_coefficients);
}

InnovationsFilter::InnovationsFilter(const Track& track, DragModel model,
                                     const FilterSettings& settings, bool sensitivities)
    : model_(std::move(model)), problem_(model_.problem()), scratch_{}, state_{} {
  require(std::isfinite(settings.noise_intensity) && settings.noise_intensity >= 0,
          "the noise intensity must not be negative");
  require(positive(settings.position_noise), "the position noise must be positive");
  require(positive(settings.largest_step), "the largest step must be positive");
  require(settings.longest_gap > 0, "the longest gap must be positive");
  require(settings.longest_gap / settings.largest_step <= 1e6,
          "the longest gap must not be above a million of the largest steps");
  check(track, problem_.orientations.count == 0);
  copy(track);
  problem_.noise_intensity = settings.noise_intensity;
  problem_.position_variance = settings.position_noise * settings.position_noise;
  problem_.largest_step = settings.largest_step;
  problem_.longest_gap = settings.longest_gap;
  if (sensitivities) {
    shares_.resize(std::size_t(model_.shares()));
    scratch_.shares = shares_.data();
    scratch_.parameters = parameters();
    scratch_.stride = (parameters() + 7) / 8 * 8;
    sensitivity_.assign(std::size_t(4 * scratch_.stride), 0.0);
    scratch_.sensitivity = sensitivity_.data();
  }
}

void InnovationsFilter::copy(const Track& track) {
  const double* const columns[] = {track.time, track.x, track.y, track.theta, track.omega};
  for (const double* column : columns) {
    track_.insert(track_.end(), column, column + track.samples);
  }
  excluded_.assign(track.excluded, track.excluded + track.samples);
  const double* const first = track_.data();
  const std::int64_t n = track.samples;
  problem_.track = {first, first + n, first + 2 * n, first + 3 * n, first + 4 * n, excluded_.data(),
                    n};
}

void InnovationsFilter::run(std::int64_t count, const FilterOutputs& out) {
  chosen_infer_kernel().run(problem_, state_, scratch_, out, std::min(count, remaining()));
}

} // namespace driftwalk
