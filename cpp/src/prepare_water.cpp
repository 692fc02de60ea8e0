// The tables of the water's acceleration Du/Dt = (u . grad) u + du/dt, from the nodes of the flow.
//
// Between two frames u goes from u0 to u1, w the share of the time that has passed:
//     Du/Dt = (1-w)^2 N0 + 2 w (1-w) C + w^2 N1 + (u1 - u0) / span
// N of a frame is (u . grad) u, C is the mean of (u0 . grad) u1 and (u1 . grad) u0. The tables of
// frame k, N, C and the last term, have the numbers 3k, 3k + 1 and 3k + 2; the last frame has N
// alone.
#include "driftwalk/simulate/prepare.hpp"

#include <algorithm>
#include <cmath>

namespace driftwalk {

namespace {
// Of one node after the other [m/s^2].
struct Field {
  std::vector<double> x, y;

  explicit Field(std::size_t nodes) : x(nodes), y(nodes) {}
};

struct Frame {
  const double* u;
  const double* v;
};

// The difference quotient along a row or column: central, one-sided at the edge of the grid.
double slope(const double* values, std::int64_t stride, int at, int count, double spacing) {
  const int before = std::max(at - 1, 0), after = std::min(at + 1, count - 1);
  return after == before ? 0
                         : (values[(after - at) * stride] - values[(before - at) * stride]) /
                               ((after - before) * spacing);
}

// Adds share * (carrier . grad) carried.
void add_advection(const BatchModel& model, const Frame& carrier, const Frame& carried,
                   double share, Field& sum) {
  std::int64_t k = 0;
  for (int row = 0; row < model.rows; ++row) {
    for (int column = 0; column < model.columns; ++column, ++k) {
      const auto along = [&](const double* values) {
        return carrier.u[k] * slope(values + k, 1, column, model.columns, model.spacing_x) +
               carrier.v[k] * slope(values + k, model.columns, row, model.rows, model.spacing_y);
      };
      sum.x[static_cast<std::size_t>(k)] += share * along(carried.u);
      sum.y[static_cast<std::size_t>(k)] += share * along(carried.v);
    }
  }
}

std::vector<Field> water_fields(const BatchModel& model, const TableGrid& grid) {
  const std::size_t nodes = static_cast<std::size_t>(grid.own_nodes());
  const auto frame = [&](int k) {
    const std::int64_t first = k * grid.own_nodes();
    return Frame{model.flow_u + first, model.flow_v + first};
  };
  std::vector<Field> fields;
  for (int k = 0; k < model.frames; ++k) {
    add_advection(model, frame(k), frame(k), 1, fields.emplace_back(nodes));
    if (k + 1 == model.frames) {
      break;
    }
    Field& crossed = fields.emplace_back(nodes);
    add_advection(model, frame(k), frame(k + 1), 0.5, crossed);
    add_advection(model, frame(k + 1), frame(k), 0.5, crossed);
    Field& rate = fields.emplace_back(nodes);
    const double span = model.frame_time[k + 1] - model.frame_time[k];
    for (std::size_t n = 0; n < nodes; ++n) {
      rate.x[n] = (frame(k + 1).u[n] - frame(k).u[n]) / span;
      rate.y[n] = (frame(k + 1).v[n] - frame(k).v[n]) / span;
    }
  }
  return fields;
}
} // namespace

template <class T>
void PreparedRun<T>::prepare_water(const BatchModel& model, const TableGrid& grid) {
  WaterView<T>& water = view_.water;
  water = {};
  water.strength = 1;
  if (model.displaced_mass == 0) {
    return;
  }
  const std::vector<Field> fields = water_fields(model, grid);
  double largest = 0;
  for (const Field& field : fields) {
    for (std::size_t n = 0; n < field.x.size(); ++n) {
      largest = std::max({largest, std::abs(field.x[n]), std::abs(field.y[n])});
    }
  }
  const double step = table_step(largest);
  // One more record: the last node's load reaches one beyond it.
  water_.resize(fields.size() * static_cast<std::size_t>(view_.frame_size) + flow_record);
  for (std::size_t k = 0; k < fields.size(); ++k) {
    write_table<T>(grid, fields[k].x.data(), fields[k].y.data(), step,
                   water_.data() + static_cast<std::int64_t>(k) * view_.frame_size);
  }
  water.nodes = view_.flow;
  water.nodes.table = water_.data();
  water.nodes.unit = table_unit<T>(step);
  water.count = model.frames > 1 ? most_water_tables : 1;
  water.part = 1;
  // Of a body as even as the water that it displaces; of a square a^2/6.
  const double displaced_inertia = view_.shape.panel_count > 0
                                       ? model.displaced_mass / view_.shape.per_radius_square
                                       : model.displaced_mass * model.side * model.side / 6;
  const double added_mass = model.added_mass_share * model.mass;
  const double added_inertia = model.added_mass_share * model.inertia;
  water.push = static_cast<T>((model.displaced_mass + added_mass) / view_.mass);
  water.spin = static_cast<T>((displaced_inertia + added_inertia) / view_.inertia);
}

template void PreparedRun<float>::prepare_water(const BatchModel&, const TableGrid&);
template void PreparedRun<double>::prepare_water(const BatchModel&, const TableGrid&);

} // namespace driftwalk
