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

void check(const Track& track, Angle angle, int layers) {
  require(all_finite(track.time, track.samples), "times must be finite");
  require(std::adjacent_find(track.time, track.time + track.samples, std::greater_equal<>()) ==
              track.time + track.samples,
          "times must increase");
  for (std::int64_t k = 0; k < track.samples; ++k) {
    require(!std::isinf(track.x[k]) && !std::isinf(track.y[k]),
            "positions must be finite, or NaN where a sample is missing");
  }
  require(track.strength != nullptr || layers == 1, "several layers need their strengths");
  require(track.strength == nullptr || all_finite(track.strength, layers * track.samples),
          "the strength of the flow must be finite");
  for (std::int64_t k = 0; track.velocity_prior != nullptr && k < 6 * track.samples; ++k) {
    require(!std::isinf(track.velocity_prior[k]) && (k % 6 < 3 || !(track.velocity_prior[k] < 0)),
            "the prior of the velocity must be finite, its deviations not negative, or NaN");
  }
  if (angle == Angle::given) {
    require(all_finite(track.theta, track.samples) && all_finite(track.omega, track.samples),
            "angles and their rates must be finite, missing samples included: interpolate them");
  } else if (angle == Angle::state) {
    require(std::none_of(track.theta, track.theta + track.samples,
                         [](double theta) { return std::isinf(theta); }),
            "angles must be finite, or NaN where one is missing");
  }
}

} // namespace

InferKernel chosen_infer_kernel() {
  return DRIFTWALK_CHOSEN(infer_kernel_);
}

DragModel::DragModel(const FloatingBlock& block, const SplineView& flow, const double* coefficients,
                     double drag_coefficient, Angle angle, const ForceLaw& law)
    : flow_(flow), law_(law), angle_(angle) {
  require(positive(block.side) && positive(block.mass) && positive(block.depth) &&
              positive(block.water_density),
          "side, mass, depth and water density must be positive");
  require(block.strips >= 1, "a side has at least one strip");
  require(positive(drag_coefficient), "the drag coefficient must be positive");
  require(std::isfinite(law.quadratic) && std::isfinite(law.linear) &&
              std::isfinite(law.water_acceleration) && std::isfinite(law.water_spin),
          "the numbers of the force law must be finite");
  require(positive(law.power.power) && positive(law.power.reference),
          "the power of the drag and its reference speed must be positive");
  require(law.linear == 0 || law.power.power == 2, "linear drag goes with the power 2 alone");
  if (law.power.power != 2) {
    const double e = law.power.power / 2 - 1;
    law_.power.at_rest = std::pow(std::tgamma(e + 2.5) / std::tgamma(2.5), 1 / e);
  }
  require(positive(flow.spacing) && std::isfinite(flow.origin_x) && std::isfinite(flow.origin_y),
          "the flow's spacing must be positive and its origin finite");
  require(flow.rows >= 4 && flow.columns >= 4, "a bicubic flow needs at least 4 rows and columns");
  require(flow.layers >= 1, "a flow has at least one layer");
  const std::int64_t nodes = std::int64_t(flow.rows) * flow.columns;
  const std::int64_t layers = flow.layers;
  require(all_finite(coefficients, 2 * nodes * layers), "coefficients must be finite");
  nodes_.reserve(std::size_t(2 * nodes * layers));
  for (std::int64_t first = 0; first < 2 * nodes * layers; first += 2 * nodes) {
    for (std::int64_t k = first; k < first + nodes; ++k) {
      nodes_.push_back(coefficients[k]);
      nodes_.push_back(coefficients[nodes + k]);
    }
  }
  block_.half_side = block.side / 2;
  block_.strip_width = block.side / block.strips;
  block_.strips = block.strips;
  block_.mass_by_inertia = 6 / (block.side * block.side);
  block_.reach = 1.5 * block_.half_side;
  // The 3 x 3 Gauss points of the square.
  constexpr double place[3] = {-0.77459666924148338, 0, 0.77459666924148338};
  constexpr double weight[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
  for (int k = 0; k < 9; ++k) {
    points_.insert(points_.end(), {block_.half_side * place[k % 3], block_.half_side * place[k / 3],
                                   weight[k % 3] * weight[k / 3]});
  }
  orientations_ = block.round ? 1 : orientations;
  if (block.panel_count > 0) {
    make_panels(block);
  }
  block_.points = int(points_.size() / 3);
  block_.drag_scale =
      0.5 * block.water_density * drag_coefficient * block_.strip_width * block.depth / block.mass;
  for (std::size_t k = 0; k < orientations; ++k) {
    const double turned = 2 * std::numbers::pi / block.symmetry * double(k) / orientations;
    cosine_[k] = std::cos(turned);
    sine_[k] = std::sin(turned);
  }
}

// The width of a strip becomes that of the mean panel.
void DragModel::make_panels(const FloatingBlock& block) {
  require(positive(block.mass_by_inertia) && block.symmetry >= 1,
          "mass over inertia and the symmetry of the body must be positive");
  require(!block.round || angle_ == Angle::none, "a disc has no angle");
  require(all_finite(block.panels, 5 * std::int64_t(block.panel_count)) &&
              all_finite(block.moment_points, 3 * std::int64_t(block.moment_point_count)),
          "the panels of the body and its points must be finite");
  const int rows = (block.panel_count + 7) / 8;
  panels_.assign(std::size_t(48 * rows), 0.0);
  double width = 0, reach = 0;
  for (int k = 0; k < block.panel_count; ++k) {
    const double* const panel = block.panels + 5 * k;
    width += panel[4] / block.panel_count;
    reach = std::max(reach, std::hypot(panel[0], panel[1]));
  }
  require(positive(width), "the panels of the body must have a width");
  for (int k = 0; k < block.panel_count; ++k) {
    double* const at = panels_.data() + 48 * (k / 8) + k % 8;
    for (int number = 0; number < 5; ++number) {
      at[8 * number] = block.panels[5 * k + number] / (number == 4 ? width : 1);
    }
    at[40] = 1;
  }
  block_.panels.count = rows;
  block_.strip_width = width;
  block_.mass_by_inertia = block.mass_by_inertia;
  block_.reach = 1.1 * reach;
  points_.assign(block.moment_points, block.moment_points + 3 * block.moment_point_count);
  if (angle_ != Angle::none || block.round) {
    return;
  }
  // Where the angle is not known, points with the mean second moment of both axes.
  double square = 0;
  for (std::size_t k = 0; k < points_.size(); k += 3) {
    square += points_[k + 2] * (points_[k] * points_[k] + points_[k + 1] * points_[k + 1]) / 2;
  }
  const double even = std::sqrt(square);
  points_ = {-even, -even, 0.25, even, -even, 0.25, -even, even, 0.25, even, even, 0.25};
}

FilterProblem DragModel::problem() const {
  FilterProblem problem{};
  problem.flow = flow_;
  problem.flow.nodes = nodes_.data();
  problem.block = block_;
  problem.block.panels.rows = panels_.data();
  problem.block.point = points_.data();
  problem.law = law_;
  problem.orientations = {cosine_.data(), sine_.data(), angle_ == Angle::none ? orientations_ : 0};
  return problem;
}

std::int64_t DragModel::shares() const {
  const int panels = block_.panels.count > 0 ? 8 * block_.panels.count : 4 * block_.strips;
  return std::int64_t(panels) * (angle_ == Angle::none ? orientations_ : 1);
}

namespace {
template <int D>
const InferKernelOf<D>& kernel_of(const InferKernel& kernel) {
  if constexpr (D == 3) {
    return kernel.pose;
  } else {
    return kernel.position;
  }
}
} // namespace

template <int D>
DragResponse<D> DragModel::drag(double theta, double omega, const double* mean,
                                const double (*covariance)[2 * D], double* by_coefficients) const {
  require(flow_.layers == 1, "the drag alone is that of a flow of one layer");
  std::vector<StripShare<D>> room(by_coefficients == nullptr ? 0 : std::size_t(shares()));
  std::vector<PointShare<D>> points(room.empty() ? 0 : std::size_t(block_.points));
  const InferKernel kernel = chosen_infer_kernel();
  return kernel_of<D>(kernel).drag(problem(), theta, omega, mean, covariance,
                                   room.empty() ? nullptr : room.data(),
                                   room.empty() ? nullptr : points.data(), by_coefficients);
}
template DragResponse<2> DragModel::drag(double, double, const double*, const double (*)[4],
                                         double*) const;
template DragResponse<3> DragModel::drag(double, double, const double*, const double (*)[6],
                                         double*) const;

InnovationsFilter::InnovationsFilter(const Track& track, DragModel model,
                                     const FilterSettings& settings, bool sensitivities)
    : model_(std::move(model)), sensitivities_(sensitivities), problem_(model_.problem()) {
  require(std::isfinite(settings.noise_intensity) && settings.noise_intensity >= 0,
          "the noise intensity must not be negative");
  require(positive(settings.position_noise), "the position noise must be positive");
  require(positive(settings.largest_step), "the largest step must be positive");
  require(std::isfinite(settings.time_noise) && settings.time_noise >= 0,
          "the noise of the time stamps must not be negative");
  require(std::isfinite(settings.force_memory) && settings.force_memory >= 0,
          "the memory of the force must not be negative");
  require(settings.longest_gap > 0, "the longest gap must be positive");
  require(settings.longest_gap / settings.largest_step <= 1e6,
          "the longest gap must not be above a million of the largest steps");
  check(track, model_.angle(), model_.layers());
  copy(track);
  const double q = settings.noise_intensity;
  const double position = settings.position_noise * settings.position_noise;
  problem_.intensity[0] = problem_.intensity[1] = q;
  problem_.variance[0] = problem_.variance[1] = position;
  problem_.largest_step = settings.largest_step;
  problem_.longest_gap = settings.longest_gap;
  problem_.time_variance = settings.time_noise * settings.time_noise;
  problem_.force_memory = settings.force_memory;
  if (model_.angle() != Angle::state) {
    make_memory_for<2>(settings.force_memory);
    return;
  }
  require(std::isfinite(settings.force_lever) && settings.force_lever >= 0,
          "the lever of the force must not be negative");
  require(positive(settings.angle_noise), "the angle noise must be positive");
  const double per_inertia = problem_.block.mass_by_inertia * settings.force_lever;
  problem_.intensity[2] = q * per_inertia * per_inertia;
  problem_.variance[2] = settings.angle_noise * settings.angle_noise;
  make_memory_for<3>(settings.force_memory);
}

template <int D>
void InnovationsFilter::make_memory_for(double force_memory) {
  if (force_memory > 0) {
    make_memory<D, 2>();
  } else {
    make_memory<D, 0>();
  }
}

template <int D, int F>
void InnovationsFilter::make_memory() {
  Memory<D, F>& memory = memory_.emplace<Memory<D, F>>();
  memory.state = {};
  memory.scratch = {};
  const std::int64_t layers = memory.scratch.layers = model_.layers();
  if (layers > 1) {
    for (std::vector<double>* const sum : {&memory.sum, &memory.sum_rate}) {
      sum->assign(std::size_t(model_.coefficients() / layers), 0.0);
    }
    memory.weight.resize(std::size_t(layers));
    memory.weight_rate.resize(std::size_t(layers));
    memory.scratch.sum = memory.sum.data();
    memory.scratch.sum_rate = memory.sum_rate.data();
    memory.scratch.weight = memory.weight.data();
    memory.scratch.weight_rate = memory.weight_rate.data();
  }
  if (sensitivities_) {
    memory.shares.resize(std::size_t(model_.shares()));
    memory.scratch.shares = memory.shares.data();
    memory.points.resize(std::size_t(model_.problem().block.points));
    memory.scratch.points = memory.points.data();
    memory.scratch.parameters = parameters();
    memory.scratch.stride = (parameters() + 7) / 8 * 8;
    memory.sensitivity.assign(std::size_t((2 * D + F) * memory.scratch.stride), 0.0);
    memory.row.resize(std::size_t(D * memory.scratch.stride));
    memory.touched.assign(std::size_t(memory.scratch.stride / 8), 0);
    memory.active.resize(std::size_t(memory.scratch.stride / 8));
    memory.scratch.sensitivity = memory.sensitivity.data();
    memory.scratch.row = memory.row.data();
    memory.scratch.touched = memory.touched.data();
    memory.scratch.active = memory.active.data();
  }
}

void InnovationsFilter::copy(const Track& track) {
  const double* const columns[] = {track.time, track.x, track.y, track.theta, track.omega};
  for (const double* column : columns) {
    track_.insert(track_.end(), column, column + track.samples);
  }
  const std::int64_t n = track.samples;
  if (track.strength != nullptr) {
    track_.insert(track_.end(), track.strength, track.strength + model_.layers() * n);
  }
  const std::size_t before_prior = track_.size();
  if (track.velocity_prior != nullptr) {
    track_.insert(track_.end(), track.velocity_prior, track.velocity_prior + 6 * n);
  }
  excluded_.assign(track.excluded, track.excluded + n);
  const double* const first = track_.data();
  problem_.track = {first,
                    first + n,
                    first + 2 * n,
                    first + 3 * n,
                    first + 4 * n,
                    track.strength == nullptr ? nullptr : first + 5 * n,
                    excluded_.data(),
                    n,
                    track.velocity_prior == nullptr ? nullptr : first + before_prior};
}

std::int64_t InnovationsFilter::remaining() const {
  return samples() - std::visit([](const auto& memory) { return memory.state.next; }, memory_);
}

void InnovationsFilter::run(std::int64_t count, const FilterOutputs& out) {
  run(count, out, nullptr);
}

void InnovationsFilter::run(std::int64_t count, const FilterOutputs& out, const ProductSums* sums) {
  const InferKernel kernel = chosen_infer_kernel();
  const std::int64_t now = std::min(count, remaining());
  std::visit(
      [&]<int D, int F>(Memory<D, F>& memory) {
        if constexpr (F == 2) {
          kernel_of<D>(kernel).run_with_memory(problem_, memory.state, memory.scratch, out, sums,
                                               now);
        } else {
          kernel_of<D>(kernel).run(problem_, memory.state, memory.scratch, out, sums, now);
        }
      },
      memory_);
}

InnovationsFilter::Sums InnovationsFilter::sums(const std::uint8_t* kept, const double* right,
                                                int columns, std::int64_t pooled,
                                                const FilterOutputs& out) {
  require(sensitivities_, "sums need sensitivities");
  require(pooled >= 1, "pooled must be at least 1");
  const std::int64_t n = remaining();
  const std::int64_t count = parameters(), stride = (count + 7) / 8 * 8;
  std::vector<double> information(std::size_t(stride * stride), 0.0);
  std::vector<double> products(std::size_t(columns * stride), 0.0);
  const auto width = std::size_t(stride), block = ProductSums::most_rows * width;
  std::vector<double> rows(block, 0.0), means(pooled > 1 ? block : 0, 0.0), dense(block, 0.0);
  std::vector<double> beside(std::size_t(ProductSums::most_rows * columns));
  std::vector<double> size(width, 0.0);
  std::vector<std::uint8_t> written(width / 8, 0), written_means(width / 8, 0);
  std::vector<std::int32_t> chosen(width);
  const ProductSums sums{columns,
                         pooled,
                         samples() - n,
                         kept,
                         right,
                         information.data(),
                         products.data(),
                         rows.data(),
                         written.data(),
                         means.data(),
                         written_means.data(),
                         size.data(),
                         dense.data(),
                         chosen.data(),
                         beside.data()};
  run(n, out, &sums);
  Sums found;
  found.information.resize(std::size_t(count * count));
  for (std::int64_t i = 0; i < count; ++i) {
    for (std::int64_t j = i; j < count; ++j) {
      // Eight columns are multiplied with the same eight and with those after them.
      found.information[std::size_t(i * count + j)] =
          found.information[std::size_t(j * count + i)] = information[std::size_t(i * stride + j)];
    }
  }
  for (int column = 0; column < columns; ++column) {
    found.products.insert(found.products.end(), products.begin() + column * stride,
                          products.begin() + column * stride + count);
  }
  return found;
}

} // namespace driftwalk
