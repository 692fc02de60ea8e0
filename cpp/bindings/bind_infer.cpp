// Bindings of the innovations filter: arrays in, arrays out, the GIL released around the work.
#include "model.hpp"

#include "driftwalk/infer/innovations.hpp"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

using namespace nb::literals;
using driftwalk::DragModel;
using driftwalk::InnovationsFilter;

namespace {

driftwalk::Angle angle_of(const std::string& orientation) {
  if (orientation == "given") {
    return driftwalk::Angle::given;
  }
  if (orientation == "none") {
    return driftwalk::Angle::none;
  }
  if (orientation != "state") {
    throw std::invalid_argument("orientation must be 'given', 'none' or 'state'");
  }
  return driftwalk::Angle::state;
}

// A body that is no single square block; empty for the block.
struct BodyArrays {
  std::optional<In<double, 2>> panels, moment_points;
  double mass_by_inertia = 0;
  int symmetry = 4;
  bool round = false;
};

driftwalk::FloatingBlock floating_block(double side, double mass, double depth, int strips,
                                        double water_density, const BodyArrays& body) {
  driftwalk::FloatingBlock block{side, mass, depth, strips, water_density};
  if (body.panels.has_value() != body.moment_points.has_value() ||
      (body.panels && (body.panels->shape(0) == 0 || body.panels->shape(1) != 5 ||
                       body.moment_points->shape(0) == 0 || body.moment_points->shape(1) != 3))) {
    throw std::invalid_argument("panels must have shape (n, 5) and moment_points (n, 3)");
  }
  if (body.panels) {
    block.panels = body.panels->data();
    block.panel_count = static_cast<int>(body.panels->shape(0));
    block.moment_points = body.moment_points->data();
    block.moment_point_count = static_cast<int>(body.moment_points->shape(0));
    block.mass_by_inertia = body.mass_by_inertia;
    block.symmetry = body.symmetry;
    block.round = body.round;
  }
  return block;
}

DragModel drag_model(double side, double mass, double depth, int strips, double water_density,
                     double origin_x, double origin_y, double spacing, int columns, int rows,
                     const In<double, 3>& coefficients, double drag_coefficient,
                     const std::string& orientation, const driftwalk::ForceLaw& law,
                     const BodyArrays& body) {
  const auto layers = static_cast<int>(coefficients.shape(0) / 2);
  if (layers < 1 || coefficients.shape(0) % 2 != 0 || coefficients.shape(1) != std::size_t(rows) ||
      coefficients.shape(2) != std::size_t(columns)) {
    throw std::invalid_argument("coefficients must have shape (2 layers, rows, columns)");
  }
  return DragModel(floating_block(side, mass, depth, strips, water_density, body),
                   {nullptr, origin_x, origin_y, spacing, columns, rows, layers},
                   coefficients.data(), drag_coefficient, angle_of(orientation), law);
}

// Left as it comes: the filter writes every number of it, and the Jacobian is large.
template <class T>
Out<T> uninitialised(std::vector<std::size_t> shape) {
  std::size_t size = 1;
  for (const std::size_t extent : shape) {
    size *= extent;
  }
  T* const values = new T[size];
  nb::capsule owner(values, [](void* p) noexcept { delete[] static_cast<T*>(p); });
  return Out<T>(values, shape.size(), shape.data(), owner);
}

// What a pass finds, with room for it.
struct PassArrays {
  PassArrays(const InnovationsFilter& filter, std::int64_t count, bool states)
      : n(static_cast<std::size_t>(count)), d(static_cast<std::size_t>(filter.coordinates())),
        innovation(uninitialised<double>({n, d})),
        covariance(uninitialised<double>({n, d * (d + 1) / 2})),
        state(uninitialised<double>({states ? n : 0, 2 * d})),
        used(uninitialised<std::uint8_t>({n})),
        out{innovation.data(), covariance.data(),
            used.data(),       states ? state.data() : nullptr,
            nullptr,           nullptr} {}

  nb::dict dict() const {
    nb::dict found;
    found["innovation"] = innovation;
    found["covariance"] = covariance;
    found["used"] = used;
    if (out.state != nullptr) {
      found["state"] = state;
    }
    return found;
  }

  std::size_t n, d;
  Out<double> innovation, covariance, state;
  Out<std::uint8_t> used;
  driftwalk::FilterOutputs out;
};

nb::dict run(InnovationsFilter& filter, std::int64_t wanted, bool states, std::int64_t pooled,
             bool errors) {
  if (wanted < 0) {
    throw std::invalid_argument("count must not be negative");
  }
  if (pooled < 1) {
    throw std::invalid_argument("pooled must be at least 1");
  }
  PassArrays pass(filter, std::min(wanted, filter.remaining()), states);
  const auto parameters = static_cast<std::size_t>(filter.parameters());
  const bool sensitivities = filter.sensitivities();
  const std::size_t rows = sensitivities ? pass.d * pass.n : 0;
  const auto pool = static_cast<std::size_t>(pooled);
  const std::size_t pools = sensitivities ? pass.d * ((pass.n + pool - 1) / pool) : 0;
  Out<double> whitened = uninitialised<double>({rows});
  Out<double> jacobian = uninitialised<double>({pools, parameters});
  pass.out.whitened = whitened.data();
  pass.out.jacobian = jacobian.data();
  pass.out.pooled = pooled;
  const auto size = static_cast<std::size_t>(filter.state_size());
  Out<double> error = uninitialised<double>({errors ? pass.n : 0, 3, size, size});
  pass.out.errors = errors ? error.data() : nullptr;
  {
    const nb::gil_scoped_release released;
    if (pooled > 1) {
      std::fill_n(jacobian.data(), pools * parameters, 0.0);
    }
    filter.run(static_cast<std::int64_t>(pass.n), pass.out);
  }
  nb::dict out = pass.dict();
  if (sensitivities) {
    out["whitened"] = whitened;
    out["jacobian"] = jacobian;
  }
  if (errors) {
    out["errors"] = error;
  }
  return out;
}

nb::dict sums(InnovationsFilter& filter, const std::optional<In<std::uint8_t, 1>>& kept,
              const std::optional<In<double, 3>>& right, std::int64_t pooled) {
  const auto n = static_cast<std::size_t>(filter.remaining());
  if ((kept && kept->size() != n) ||
      (right && (right->shape(0) != n || right->shape(1) != std::size_t(filter.coordinates())))) {
    throw std::invalid_argument("kept must have shape (n,) and right (n, coordinates, columns), n "
                                "the samples that remain");
  }
  PassArrays pass(filter, filter.remaining(), false);
  const auto parameters = static_cast<std::size_t>(filter.parameters());
  const std::size_t columns = right ? right->shape(2) : 1;
  InnovationsFilter::Sums found;
  {
    const nb::gil_scoped_release released;
    found = filter.sums(kept ? kept->data() : nullptr, right ? right->data() : nullptr,
                        static_cast<int>(columns), pooled, pass.out);
  }
  nb::dict out = pass.dict();
  out["information"] = hand_out(std::move(found.information), {parameters, parameters});
  out["products"] = hand_out(std::move(found.products), {columns, parameters});
  return out;
}

template <int D>
nb::dict response_of(const DragModel& model, const In<double, 3>& coefficients,
                     const In<double, 1>& mean, double theta, double omega,
                     const In<double, 2>& covariance) {
  constexpr std::size_t n = 2 * D;
  if (mean.shape(0) != n || covariance.shape(0) != n || covariance.shape(1) != n) {
    throw std::invalid_argument("mean must have shape (4,) and covariance (4, 4), (6,) and (6, 6) "
                                "with orientation 'state'");
  }
  double P[n][n];
  std::copy_n(covariance.data(), n * n, &P[0][0]);
  std::vector<double> by_coefficients(D * coefficients.size(), 0.0);
  const driftwalk::DragResponse<D> drag =
      model.drag<D>(D == 3 ? mean.data()[2] : theta, D == 3 ? mean.data()[n - 1] : omega,
                    mean.data(), P, by_coefficients.data());
  const auto matrix = [](const double (&values)[D][D]) {
    return hand_out(std::vector<double>(&values[0][0], &values[0][0] + D * D), {D, D});
  };
  nb::dict out;
  out["acceleration"] =
      hand_out(std::vector<double>(drag.acceleration, drag.acceleration + D), {D});
  out["by_position"] = matrix(drag.by_position);
  out["by_velocity"] = matrix(drag.by_velocity);
  out["by_coefficients"] =
      hand_out(std::move(by_coefficients), {D, 2, coefficients.shape(1), coefficients.shape(2)});
  return out;
}

nb::dict expected_drag(double side, double mass, double depth, int strips, double water_density,
                       double origin_x, double origin_y, double spacing, int columns, int rows,
                       const In<double, 3>& coefficients, double drag_coefficient,
                       const std::string& orientation, const In<double, 1>& mean, double theta,
                       double omega, const In<double, 2>& covariance, double quadratic,
                       double linear, double water_acceleration, double water_spin,
                       double drag_power, double drag_speed, std::optional<In<double, 2>> panels,
                       std::optional<In<double, 2>> moment_points, double mass_by_inertia,
                       int symmetry, bool round) {
  const DragModel model =
      drag_model(side, mass, depth, strips, water_density, origin_x, origin_y, spacing, columns,
                 rows, coefficients, drag_coefficient, orientation,
                 {quadratic, linear, water_acceleration, water_spin, {drag_power, drag_speed}},
                 {std::move(panels), std::move(moment_points), mass_by_inertia, symmetry, round});
  return model.angle() == driftwalk::Angle::state
             ? response_of<3>(model, coefficients, mean, theta, omega, covariance)
             : response_of<2>(model, coefficients, mean, theta, omega, covariance);
}

} // namespace

void register_infer(nb::module_& module);
void register_infer(nb::module_& module) {
  nb::class_<InnovationsFilter>(module, "InnovationsFilter")
      .def(
          "__init__",
          [](InnovationsFilter* self, In<double, 1> time, In<double, 1> x, In<double, 1> y,
             In<double, 1> theta, In<double, 1> omega, In<std::uint8_t, 1> excluded, double side,
             double mass, double depth, int strips, double water_density, double origin_x,
             double origin_y, double spacing, int columns, int rows, In<double, 3> coefficients,
             double drag_coefficient, double noise_intensity, double position_noise,
             double force_lever, double angle_noise, double largest_step, double longest_gap,
             const std::string& orientation, bool sensitivities,
             const std::optional<In<double, 2>>& strength, double quadratic, double linear,
             double water_acceleration, double water_spin, double drag_power, double drag_speed,
             double time_noise, double force_memory, std::optional<In<double, 2>> panels,
             std::optional<In<double, 2>> moment_points, double mass_by_inertia, int symmetry,
             bool round, const std::optional<In<double, 2>>& velocity_prior) {
            const std::size_t n = time.size();
            if (x.size() != n || y.size() != n || theta.size() != n || omega.size() != n ||
                excluded.size() != n || (strength && strength->shape(1) != n)) {
              throw std::invalid_argument(
                  "time, x, y, theta, omega, excluded and strength differ in length");
            }
            if (strength && 2 * strength->shape(0) != coefficients.shape(0)) {
              throw std::invalid_argument("strength must have shape (layers, n)");
            }
            if (velocity_prior &&
                (velocity_prior->shape(0) != n || velocity_prior->shape(1) != 6)) {
              throw std::invalid_argument("velocity_prior must have shape (n, 6)");
            }
            new (self) InnovationsFilter(
                {time.data(), x.data(), y.data(), theta.data(), omega.data(),
                 strength ? strength->data() : nullptr, excluded.data(),
                 static_cast<std::int64_t>(n), velocity_prior ? velocity_prior->data() : nullptr},
                drag_model(
                    side, mass, depth, strips, water_density, origin_x, origin_y, spacing, columns,
                    rows, coefficients, drag_coefficient, orientation,
                    {quadratic, linear, water_acceleration, water_spin, {drag_power, drag_speed}},
                    {std::move(panels), std::move(moment_points), mass_by_inertia, symmetry,
                     round}),
                {noise_intensity, position_noise, force_lever, angle_noise, largest_step,
                 longest_gap, time_noise, force_memory},
                sensitivities);
          },
          "time"_a, "x"_a, "y"_a, "theta"_a, "omega"_a, "excluded"_a, nb::kw_only(), "side"_a,
          "mass"_a, "depth"_a, "strips"_a, "water_density"_a, "origin_x"_a, "origin_y"_a,
          "spacing"_a, "columns"_a, "rows"_a, "coefficients"_a, "drag_coefficient"_a,
          "noise_intensity"_a, "position_noise"_a, "force_lever"_a = 0.0, "angle_noise"_a = 0.01,
          "largest_step"_a = 0.05, "longest_gap"_a = 1.0, "orientation"_a = "given",
          "sensitivities"_a = false, "strength"_a = nb::none(), "quadratic"_a = 1.0,
          "linear"_a = 0.0, "water_acceleration"_a = 0.0, "water_spin"_a = 0.0,
          "drag_power"_a = 2.0, "drag_speed"_a = 0.03, "time_noise"_a = 0.0, "force_memory"_a = 0.0,
          "panels"_a = nb::none(), "moment_points"_a = nb::none(), "mass_by_inertia"_a = 0.0,
          "symmetry"_a = 4, "round"_a = false, "velocity_prior"_a = nb::none())
      .def_prop_ro("samples", &InnovationsFilter::samples)
      .def_prop_ro("remaining", &InnovationsFilter::remaining)
      .def_prop_ro("parameters", &InnovationsFilter::parameters)
      .def_prop_ro("coordinates", &InnovationsFilter::coordinates)
      .def("run", &run, "count"_a, nb::kw_only(), "states"_a = true, "pooled"_a = 1,
           "errors"_a = false)
      .def("sums", &sums, "kept"_a.none(), "right"_a.none(), nb::kw_only(), "pooled"_a = 1);
  module.def("expected_drag", &expected_drag, nb::kw_only(), "side"_a, "mass"_a, "depth"_a,
             "strips"_a, "water_density"_a, "origin_x"_a, "origin_y"_a, "spacing"_a, "columns"_a,
             "rows"_a, "coefficients"_a, "drag_coefficient"_a, "orientation"_a, "mean"_a, "theta"_a,
             "omega"_a, "covariance"_a, "quadratic"_a = 1.0, "linear"_a = 0.0,
             "water_acceleration"_a = 0.0, "water_spin"_a = 0.0, "drag_power"_a = 2.0,
             "drag_speed"_a = 0.03, "panels"_a = nb::none(), "moment_points"_a = nb::none(),
             "mass_by_inertia"_a = 0.0, "symmetry"_a = 4, "round"_a = false);
}
