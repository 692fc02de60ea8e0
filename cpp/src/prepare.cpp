#include "driftwalk/simulate/prepare.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <type_traits>

namespace driftwalk {

namespace {
// Half extents of the arena about the origin: where a block's centre can be.
void arena_extent(const BatchModel& model, double& low_x, double& high_x, double& low_y,
                  double& high_y) {
  if (model.radius > 0) {
    low_x = low_y = -model.radius;
    high_x = high_y = model.radius;
    return;
  }
  // The corners of a convex polygon are where neighbouring edges meet.
  low_x = low_y = HUGE_VAL;
  high_x = high_y = -HUGE_VAL;
  for (int e = 0; e < model.edge_count; ++e) {
    const double* a = model.edges + 3 * e;
    const double* b = model.edges + 3 * ((e + 1) % model.edge_count);
    const double determinant = a[0] * b[1] - a[1] * b[0];
    const double x = (a[2] * b[1] - b[2] * a[1]) / determinant;
    const double y = (a[0] * b[2] - b[0] * a[2]) / determinant;
    low_x = std::min(low_x, x);
    high_x = std::max(high_x, x);
    low_y = std::min(low_y, y);
    high_y = std::max(high_y, y);
  }
}

template <class T>
std::vector<PreparedEdge<T>> prepare_edges(const double* edges, int count) {
  std::vector<PreparedEdge<T>> prepared(static_cast<std::size_t>(count));
  for (PreparedEdge<T>& edge : prepared) {
    edge = {static_cast<T>(edges[0]), static_cast<T>(edges[1]), static_cast<T>(edges[2])};
    edges += 3;
  }
  return prepared;
}

int padding(double reach, double spacing) {
  return static_cast<int>(std::ceil(reach / spacing)) + 1;
}
} // namespace

template <class T>
void write_table(const TableGrid& grid, const double* u, const double* v, double step,
                 typename FlowNumber<T>::type* out) {
  using Node = typename FlowNumber<T>::type;
  const auto node = [&](const double* values, int row, int column) {
    row = std::clamp(row - grid.bottom, 0, grid.own_rows - 1);
    column = std::clamp(column - grid.left, 0, grid.own_columns - 1);
    const double rounded = std::round(values[std::int64_t(row) * grid.own_columns + column] / step);
    return static_cast<Node>(std::is_integral_v<Node> ? rounded : rounded * step);
  };
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column, out += flow_record) {
      out[0] = node(u, row, column);
      out[1] = node(u, row + 1, column);
      out[2] = node(v, row, column);
      out[3] = node(v, row + 1, column);
    }
  }
}

template void write_table<float>(const TableGrid&, const double*, const double*, double,
                                 std::int16_t*);
template void write_table<double>(const TableGrid&, const double*, const double*, double, double*);

double table_step(double largest) {
  return largest > 0 ? largest / 32767 : 1;
}

template <class T>
T table_unit(double step) {
  return std::is_integral_v<typename FlowNumber<T>::type> ? static_cast<T>(step / 32767) : T(1);
}

template float table_unit<float>(double);
template double table_unit<double>(double);

template <class T>
PreparedRun<T>::PreparedRun(const BatchModel& model) {
  view_.block.half_side = static_cast<T>(model.side / 2);
  view_.block.strip_width = static_cast<T>(model.side / model.strips);
  view_.block.strips = model.strips;
  view_.step.dt = static_cast<T>(model.time_step);
  view_.step.per_dt = static_cast<T>(1.0 / model.time_step);
  view_.step.per_inertia = static_cast<T>(model.mass / model.inertia);
  view_.steps_per_interval = model.steps_per_interval;
  view_.drag_scale = 0.5 * model.water_density * (model.side / model.strips) * model.depth;
  view_.mass = model.mass * (1 + model.added_mass_share);
  view_.inertia = model.inertia * (1 + model.added_mass_share);
  prepare_shape(model);
  const int strips = model.panel_count > 0 ? model.panel_count : 4 * model.strips;
  view_.drag = {static_cast<T>(model.linear_drag / strips / view_.drag_scale),
                static_cast<T>(model.drag_power / 2 - 1),
                static_cast<T>(1 / (model.drag_speed * model.drag_speed)),
                model.linear_drag == 0 && model.drag_power == 2};
  prepare_force(model);
  view_.position_noise = static_cast<T>(model.position_noise);
  view_.orientation_noise = static_cast<T>(model.orientation_noise);
  view_.position_quantum = static_cast<T>(model.position_quantum);
  prepare_wall(model);
  prepare_flow(model);
  prepare_samples(model);
  prepare_view(model);
}

// The width of a strip of the drag becomes that of the mean panel.
template <class T>
void PreparedRun<T>::prepare_shape(const BatchModel& model) {
  BodyShape<T>& shape = view_.shape;
  shape = {};
  if (model.panel_count == 0) {
    return;
  }
  double width = 0, turning = 0, reach = model.disc_radius;
  for (int k = 0; k < model.panel_count; ++k) {
    const double* const panel = model.panels + 5 * k;
    const double square = panel[0] * panel[0] + panel[1] * panel[1];
    width += panel[4];
    turning += panel[4] * square;
    reach = std::max(reach, std::sqrt(square));
  }
  const double mean_width = width / model.panel_count;
  for (int k = 0; k < model.panel_count; ++k) {
    const double* const panel = model.panels + 5 * k;
    panels_.push_back({static_cast<T>(panel[0]), static_cast<T>(panel[1]), static_cast<T>(panel[2]),
                       static_cast<T>(panel[3]), static_cast<T>(panel[4] / mean_width)});
  }
  for (int k = 0; k < model.corner_count; ++k) {
    const double x = model.corners[2 * k], y = model.corners[2 * k + 1];
    corners_.push_back({static_cast<T>(x), static_cast<T>(y)});
    reach = std::max(reach, std::hypot(x, y));
  }
  double radius_square = 0;
  for (int k = 0; k < model.moment_point_count; ++k) {
    const double* const point = model.moment_points + 3 * k;
    points_.push_back(
        {static_cast<T>(point[0]), static_cast<T>(point[1]), static_cast<T>(point[2])});
    radius_square += point[2] * (point[0] * point[0] + point[1] * point[1]);
  }
  shape.points = points_.data();
  shape.point_count = model.moment_point_count;
  shape.panels = panels_.data();
  shape.panel_count = model.panel_count;
  shape.corners = corners_.data();
  shape.corner_count = model.corner_count;
  if (model.corner_count == 4) {
    shape.half_length = std::abs(corners_[0].x);
    shape.half_width = std::abs(corners_[0].y);
  }
  shape.disc_radius = static_cast<T>(model.disc_radius);
  shape.reach = static_cast<T>(reach);
  shape.turning_share = static_cast<T>(turning / width);
  shape.per_radius_square = static_cast<T>(1 / radius_square);
  view_.drag_scale = 0.5 * model.water_density * mean_width * model.depth;
}

template <class T>
void PreparedRun<T>::prepare_wall(const BatchModel& model) {
  view_.wall.radius = static_cast<T>(model.radius);
  view_.wall.restitution = static_cast<T>(model.restitution);
  view_.wall.friction = static_cast<T>(model.friction);
  view_.wall.bounce_speed = static_cast<T>(model.bounce_speed);
  edges_ = prepare_edges<T>(model.edges, model.edge_count);
  view_.wall.edges = edges_.data();
  view_.wall.edge_count = model.edge_count;
}

template <class T>
void PreparedRun<T>::prepare_view(const BatchModel& model) {
  view_.view_radius = static_cast<T>(model.view_radius);
  view_.view_x = static_cast<T>(model.view_x);
  view_.view_y = static_cast<T>(model.view_y);
  view_edges_ = prepare_edges<T>(model.view_edges, model.view_edge_count);
  view_.view_edges = view_edges_.data();
  view_.view_edge_count = model.view_edge_count;
}

// One record per node; beyond the grid the nearest node's value goes on. Velocities are rounded to
// max|u| / 32767 in both tables, so that the reference sees the flow that the kernels see.
template <class T>
void PreparedRun<T>::prepare_flow(const BatchModel& model) {
  FlowView<T>& flow = view_.flow;
  double low_x, high_x, low_y, high_y;
  arena_extent(model, low_x, high_x, low_y, high_y);
  // The farthest strip centre from a block's centre lies within its half diagonal.
  const double reach = model.panel_count > 0 ? static_cast<double>(view_.shape.reach)
                                             : model.side * 0.5 * std::sqrt(2.0);
  const double right = model.origin_x + (model.columns - 1) * model.spacing_x;
  const double top = model.origin_y + (model.rows - 1) * model.spacing_y;
  const int left_pad = padding(std::max(model.origin_x - low_x, 0.0) + reach, model.spacing_x);
  const int right_pad = padding(std::max(high_x - right, 0.0) + reach, model.spacing_x);
  const int bottom_pad = padding(std::max(model.origin_y - low_y, 0.0) + reach, model.spacing_y);
  const int top_pad = padding(std::max(high_y - top, 0.0) + reach, model.spacing_y);
  flow.stride_bits = static_cast<int>(
      std::bit_width(static_cast<unsigned>(model.columns + left_pad + right_pad - 1)));
  const TableGrid grid{
      left_pad,   bottom_pad,   model.rows + bottom_pad + top_pad, 1 << flow.stride_bits,
      model.rows, model.columns};

  const std::int64_t nodes = std::int64_t(model.frames) * model.rows * model.columns;
  double largest = 0;
  for (std::int64_t k = 0; k < nodes; ++k) {
    largest = std::max({largest, std::abs(model.flow_u[k]), std::abs(model.flow_v[k])});
  }
  const double step = table_step(largest);
  flow.unit = table_unit<T>(step);
  flow.origin_x = static_cast<T>(model.origin_x - left_pad * model.spacing_x);
  flow.origin_y = static_cast<T>(model.origin_y - bottom_pad * model.spacing_y);
  flow.per_spacing_x = static_cast<T>(1.0 / model.spacing_x);
  flow.per_spacing_y = static_cast<T>(1.0 / model.spacing_y);
  flow.low_x = static_cast<T>(low_x);
  flow.high_x = static_cast<T>(high_x);
  flow.low_y = static_cast<T>(low_y);
  flow.high_y = static_cast<T>(high_y);

  view_.frames = model.frames;
  view_.repeat = model.repeat;
  view_.frame_size = std::int64_t(grid.rows) * grid.columns * flow_record;
  // One more record: the last node's load reaches one beyond it.
  table_.resize(static_cast<std::size_t>(view_.frame_size * model.frames + flow_record));
  for (int frame = 0; frame < model.frames; ++frame) {
    const std::int64_t first = frame * grid.own_nodes();
    write_table<T>(grid, model.flow_u + first, model.flow_v + first, step,
                   table_.data() + frame * view_.frame_size);
  }
  flow.table = table_.data();
  flow.lanes = nullptr;
  if (model.frames > 1) {
    frame_time_.assign(model.frame_time, model.frame_time + model.frames);
  }
  view_.frame_time = frame_time_.data();
  prepare_water(model, grid);
}

// The force forgets exponentially. What is drawn anew is so large that the sum of the forces over a
// long time, the noise intensity, is that without memory; the first has the spread of all others.
template <class T>
void PreparedRun<T>::prepare_force(const BatchModel& model) {
  const double interval = model.steps_per_interval * model.time_step;
  const double kept = model.force_memory > 0 ? std::exp(-interval / model.force_memory) : 0;
  view_.force_lever = static_cast<T>(model.force_lever);
  view_.force_kept = static_cast<T>(kept);
  view_.force_first = static_cast<T>(std::sqrt((1 - kept) / (1 + kept)));
}

template <class T>
void PreparedRun<T>::prepare_samples(const BatchModel& model) {
  const std::size_t count = static_cast<std::size_t>(model.samples);
  sample_step_.resize(count);
  sample_weight_.resize(count);
  for (std::size_t k = 0; k < count; ++k) {
    const double steps = model.sample_time[k] / model.time_step;
    // A sample on a step's end belongs to that step, whichever way the division rounded.
    const double nearest = std::round(steps);
    const double exact = std::abs(steps - nearest) < 1e-9 * (1.0 + steps) ? nearest : steps;
    const double index = std::max(std::ceil(exact) - 1.0, 0.0);
    sample_step_[k] = static_cast<std::int64_t>(index);
    sample_weight_[k] = static_cast<T>(exact - index);
  }
  view_.samples = model.samples;
  view_.sample_step = sample_step_.data();
  view_.sample_weight = sample_weight_.data();
}

template class PreparedRun<float>;
template class PreparedRun<double>;

} // namespace driftwalk
