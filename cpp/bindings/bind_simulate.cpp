// Bindings of the simulation core: arrays in, arrays out, the GIL released around the work.
#include "model.hpp"

#include "driftwalk/dispatch.hpp"
#include "driftwalk/math/elementary.hpp"
#include "driftwalk/physics/laws/mixed.hpp"
#include "driftwalk/random/normal.hpp"
#include "driftwalk/random/philox.hpp"
#include "driftwalk/simulate/run.hpp"
#include "driftwalk/simulate/simulate.hpp"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <stdexcept>

using namespace nb::literals;

namespace {

// A self-propelled particle instead of the block: what all worlds of a batch have in common.
struct Particle {
  driftwalk::ParticleModel model;
  std::optional<In<double, 3>> neighbours; // keeps what the model points to
};

driftwalk::ParticleModel particle_model(const std::string& kind, int states,
                                        const std::string& contact, bool carried) {
  using driftwalk::ParticleKind;
  using driftwalk::WallContact;
  driftwalk::ParticleModel model;
  model.kind = kind == "inertial"    ? ParticleKind::inertial
               : kind == "switching" ? ParticleKind::switching
                                     : ParticleKind::none;
  model.contact = contact == "reflect" ? WallContact::reflect : WallContact::slide;
  model.states = states;
  model.carried = carried;
  const bool switching = model.kind == ParticleKind::switching;
  if (model.kind == ParticleKind::none || (contact != "reflect" && contact != "slide") ||
      states < (switching ? 1 : 0) || states > (switching ? driftwalk::most_particle_states : 0)) {
    throw std::invalid_argument("no such particle");
  }
  return model;
}

Particle particle(const std::string& kind, int states, const std::string& contact, bool carried,
                  std::optional<In<double, 3>> neighbours) {
  Particle made{particle_model(kind, states, contact, carried), std::move(neighbours)};
  if (made.neighbours) {
    const In<double, 3>& place = *made.neighbours;
    if (place.shape(0) == 0 || place.shape(2) != 2) {
      throw std::invalid_argument("neighbours must have shape (steps, neighbours, 2)");
    }
    made.model.neighbours = {static_cast<std::int64_t>(place.shape(0)),
                             static_cast<int>(place.shape(1)), place.data()};
  }
  return made;
}

int columns_of(const driftwalk::ParticleModel& model) {
  switch (model.kind) {
  case driftwalk::ParticleKind::switching:
    return driftwalk::particle_columns(model.states);
  case driftwalk::ParticleKind::inertial:
    return driftwalk::inertial_columns;
  case driftwalk::ParticleKind::none:
    break;
  }
  return 2;
}

// Worlds as the columns of one array: x, y, theta, vx, vy, omega; then drag coefficient and
// force std, or a particle's numbers; and their random keys.
class Worlds {
public:
  Worlds(const In<double, 2>& table, const In<std::uint64_t, 1>& key, const Particle* particle,
         const std::optional<In<double, 1>>& flow_start)
      : count_(table.shape(0)), columns_(table.size()),
        particle_(particle == nullptr ? driftwalk::ParticleModel() : particle->model) {
    const std::size_t width = 6 + static_cast<std::size_t>(columns_of(particle_));
    if (table.shape(1) != width || key.size() != count_) {
      throw std::invalid_argument("worlds must have shape (n, " + std::to_string(width) +
                                  ") and key shape (n,)");
    }
    for (std::size_t row = 0; row < count_; ++row) {
      for (std::size_t column = 0; column < width; ++column) {
        columns_[column * count_ + row] = table(row, column);
      }
    }
    key_.assign(key.data(), key.data() + count_);
    if (const double* const start = starts_of(flow_start, count_)) {
      flow_start_.assign(start, start + count_);
    }
  }

  std::size_t count() const { return count_; }
  driftwalk::BatchWorlds view() const {
    const auto column = [&](std::size_t k) { return columns_.data() + k * count_; };
    driftwalk::BatchWorlds view;
    view.count = static_cast<std::int64_t>(count_);
    view.x = column(0);
    view.y = column(1);
    view.theta = column(2);
    view.vx = column(3);
    view.vy = column(4);
    view.omega = column(5);
    view.particle = particle_;
    if (particle_.kind == driftwalk::ParticleKind::none) {
      view.drag_coefficient = column(6);
      view.force_std = column(7);
    } else {
      view.particle.values = column(6);
    }
    view.key = key_.data();
    view.flow_start = flow_start_.empty() ? nullptr : flow_start_.data();
    return view;
  }

private:
  std::size_t count_;
  std::vector<double> columns_, flow_start_;
  std::vector<std::uint64_t> key_;
  driftwalk::ParticleModel particle_;
};

template <class T>
nb::tuple simulate_as(const driftwalk::PreparedRun<T>& run, const Worlds& worlds,
                      std::int64_t samples, int threads) {
  const std::size_t count = worlds.count(), n = static_cast<std::size_t>(samples);
  std::vector<T> x(count * n), y(count * n), theta(count * n);
  std::vector<std::uint32_t> status(count);
  {
    nb::gil_scoped_release release;
    driftwalk::simulate_batch(run, worlds.view(), threads,
                              {x.data(), y.data(), theta.data(), status.data()});
  }
  return nb::make_tuple(hand_out(std::move(x), {count, n}), hand_out(std::move(y), {count, n}),
                        hand_out(std::move(theta), {count, n}),
                        hand_out(std::move(status), {count}));
}

nb::tuple simulate(const Model& model, In<double, 2> table, In<std::uint64_t, 1> key, int threads,
                   const std::string& precision, const Particle* particle,
                   const std::optional<In<double, 1>>& flow_start) {
  const Worlds worlds(table, key, particle, flow_start);
  if (precision == "double") {
    return simulate_as(model.twice(), worlds, model.samples(), threads);
  }
  return simulate_as(model.single(), worlds, model.samples(), threads);
}

nb::dict score(const Model& model, In<double, 2> table, In<std::uint64_t, 1> key,
               In<std::int32_t, 1> left, In<double, 1> weight, In<std::int32_t, 1> triple,
               std::optional<In<double, 2>> reference, int bins, double length_limit,
               double angle_limit, std::int64_t excerpt, bool keep_steps, int threads,
               const Particle* particle, const std::optional<In<double, 1>>& flow_start) {
  const Worlds worlds(table, key, particle, flow_start);
  const std::size_t count = worlds.count();
  driftwalk::Scoring scoring;
  scoring.plan = {left.data(), weight.data(), triple.data(), static_cast<std::int64_t>(left.size()),
                  static_cast<std::int64_t>(triple.size())};
  scoring.length_bins = scoring.angle_bins = bins;
  scoring.length_limit = length_limit;
  scoring.angle_limit = angle_limit;
  scoring.excerpt = std::min(excerpt, model.samples());
  std::optional<driftwalk::KsReference> prepared;
  if (reference) {
    std::vector<double> length(reference->shape(0)), angle(length.size());
    for (std::size_t k = 0; k < length.size(); ++k) {
      length[k] = (*reference)(k, 0);
      angle[k] = (*reference)(k, 1);
    }
    prepared.emplace(length.data(), angle.data(), static_cast<std::int64_t>(length.size()));
    scoring.reference = &*prepared;
  }
  const std::size_t cells = static_cast<std::size_t>(bins) * static_cast<std::size_t>(bins);
  const std::size_t kept = static_cast<std::size_t>(scoring.excerpt);
  const std::size_t scored = reference ? count : 0;
  const std::size_t pairs = triple.size(), stored = keep_steps ? count * pairs : 0;
  std::vector<double> distance(scored), place_length(scored), place_angle(scored);
  std::vector<std::int32_t> quadrant(scored);
  std::vector<std::int64_t> pair_count(count);
  std::vector<std::uint32_t> status(count);
  std::vector<float> density(count * cells), excerpt_x(count * kept), excerpt_y(count * kept);
  std::vector<double> length(stored), angle(stored);
  const auto wanted = [](auto& values) { return values.empty() ? nullptr : values.data(); };
  {
    nb::gil_scoped_release release;
    driftwalk::score_batch(model.single(), worlds.view(), scoring, threads,
                           {wanted(distance), wanted(place_length), wanted(place_angle),
                            wanted(quadrant), pair_count.data(), status.data(), wanted(density),
                            wanted(excerpt_x), wanted(excerpt_y), wanted(length), wanted(angle)});
  }
  const std::size_t rows = static_cast<std::size_t>(bins);
  nb::dict out;
  out["pairs"] = hand_out(std::move(pair_count), {count});
  out["status"] = hand_out(std::move(status), {count});
  if (reference) {
    out["ks_distance"] = hand_out(std::move(distance), {count});
    out["ks_step_length"] = hand_out(std::move(place_length), {count});
    out["ks_turning_angle"] = hand_out(std::move(place_angle), {count});
    out["ks_quadrant"] = hand_out(std::move(quadrant), {count});
  }
  if (bins > 0) {
    out["step_density"] = hand_out(std::move(density), {count, rows, rows});
  }
  if (kept > 0) {
    out["excerpt_x"] = hand_out(std::move(excerpt_x), {count, kept});
    out["excerpt_y"] = hand_out(std::move(excerpt_y), {count, kept});
  }
  if (keep_steps) {
    out["step_length"] = hand_out(std::move(length), {count, pairs});
    out["turning_angle"] = hand_out(std::move(angle), {count, pairs});
  }
  return out;
}

driftwalk::StepTable step_table(const In<double, 2>& length, const In<double, 2>& angle,
                                const In<std::int64_t, 1>& count) {
  if (length.shape(0) != angle.shape(0) || length.shape(1) != angle.shape(1) ||
      count.size() != length.shape(0)) {
    throw std::invalid_argument("step lengths, turning angles and counts do not match");
  }
  return {length.data(), angle.data(), count.data(), static_cast<std::int64_t>(length.shape(0)),
          static_cast<std::int64_t>(length.shape(1))};
}

Out<double> ks_matrix(In<double, 2> a_length, In<double, 2> a_angle, In<std::int64_t, 1> a_count,
                      In<double, 2> b_length, In<double, 2> b_angle, In<std::int64_t, 1> b_count,
                      int threads) {
  const driftwalk::StepTable a = step_table(a_length, a_angle, a_count);
  const driftwalk::StepTable b = step_table(b_length, b_angle, b_count);
  std::vector<double> out(static_cast<std::size_t>(a.rows * b.rows));
  {
    nb::gil_scoped_release release;
    driftwalk::ks_matrix(a, b, threads, out.data());
  }
  return hand_out(std::move(out),
                  {static_cast<std::size_t>(a.rows), static_cast<std::size_t>(b.rows)});
}

// Drag force [N] and torque [N m] on a body of the model, in double precision.
std::tuple<double, double, double> drag(const Model& model, double drag_coefficient, double x,
                                        double y, double theta, double vx, double vy,
                                        double omega) {
  const driftwalk::Prepared<double>& run = model.twice().view();
  driftwalk::Axes<double> axes;
  driftwalk::sincos(theta, axes.sine, axes.cosine);
  const driftwalk::Motion<double> motion{vx, vy, omega};
  const auto sums_of = [&](const auto& law) {
    return run.shape.panel_count > 0
               ? driftwalk::panel_sums(law, run.shape, run.flow, x, y, axes, motion)
               : driftwalk::drag_sums(law, run.block, run.flow, x, y, axes, motion);
  };
  const auto mixed = driftwalk::MixedDrag<double>::of(drag_coefficient, run.drag);
  const bool quadratic = run.drag.is_quadratic;
  const driftwalk::DragSums<double> sums =
      quadratic ? sums_of(driftwalk::QuadraticDrag{}) : sums_of(mixed);
  const double scale = run.drag_scale * (quadratic ? drag_coefficient : 1);
  return {sums.force_x * scale, sums.force_y * scale, sums.torque * scale};
}

std::vector<std::uint32_t> philox(std::uint64_t key, const std::vector<std::uint32_t>& counter) {
  if (counter.size() != 4) {
    throw std::invalid_argument("a counter has four words");
  }
  const driftwalk::Philox<std::uint32_t> stream{static_cast<std::uint32_t>(key),
                                                static_cast<std::uint32_t>(key >> 32)};
  std::vector<std::uint32_t> out(4);
  stream(counter[0], counter[1], counter[2], counter[3], out.data());
  return out;
}

} // namespace

void register_simulate(nb::module_& module);
void register_simulate(nb::module_& module) {
  nb::class_<Model> model(module, "Model");
  model
      .def(
          "__init__",
          [](Model* self, In<double, 2> edges, In<double, 3> u, In<double, 3> v,
             In<double, 1> frame_time, In<double, 1> sample_time, In<double, 2> view_edges,
             const std::string& flow_repeat, std::optional<In<double, 2>> panels,
             std::optional<In<double, 2>> corners, std::optional<In<double, 2>> moment_points,
             const nb::kwargs& numbers) {
            new (self) Model(numbers_of(numbers), {edges, u, v, frame_time, sample_time, view_edges,
                                                   repeat_of(flow_repeat), std::move(panels),
                                                   std::move(corners), std::move(moment_points)});
          },
          nb::kw_only(), "edges"_a, "u"_a, "v"_a, "frame_time"_a, "sample_time"_a, "view_edges"_a,
          "flow_repeat"_a = "hold", "panels"_a = nb::none(), "corners"_a = nb::none(),
          "moment_points"_a = nb::none(), "numbers"_a)
      .def_prop_ro("samples", &Model::samples);
  driftwalk::each_model_number([&](const char* name, const char*, driftwalk::Range, auto field) {
    model.def_prop_ro(name, [field](const Model& self) { return self.numbers().*field; });
  });
  nb::class_<Particle>(module, "Particle")
      .def(
          "__init__",
          [](Particle* self, const std::string& kind, int states, const std::string& contact,
             bool carried, std::optional<In<double, 3>> neighbours) {
            new (self) Particle(particle(kind, states, contact, carried, std::move(neighbours)));
          },
          nb::kw_only(), "kind"_a, "states"_a, "contact"_a, "carried"_a,
          "neighbours"_a = nb::none())
      .def_prop_ro("columns", [](const Particle& self) { return columns_of(self.model); });
  module.def("simulate", &simulate, "model"_a, "worlds"_a, "key"_a, nb::kw_only(), "threads"_a,
             "precision"_a, "particle"_a = nb::none(), "flow_start"_a = nb::none());
  module.def("score", &score, "model"_a, "worlds"_a, "key"_a, nb::kw_only(), "left"_a, "weight"_a,
             "triple"_a, "reference"_a.none(), "bins"_a, "length_limit"_a, "angle_limit"_a,
             "excerpt"_a, "keep_steps"_a, "threads"_a, "particle"_a = nb::none(),
             "flow_start"_a = nb::none());
  module.def("ks_matrix", &ks_matrix, "a_length"_a, "a_angle"_a, "a_count"_a, "b_length"_a,
             "b_angle"_a, "b_count"_a, nb::kw_only(), "threads"_a);
  module.def("drag", &drag, "model"_a, nb::kw_only(), "drag_coefficient"_a, "x"_a, "y"_a, "theta"_a,
             "vx"_a, "vy"_a, "omega"_a);
  module.def("philox", &philox, "key"_a, "counter"_a);
  module.def("instruction_set",
             [] { return std::string(driftwalk::name(driftwalk::chosen_instruction_set())); });
  module.def("available_instruction_sets", [] {
    std::vector<std::string> names;
    for (const auto set : {driftwalk::InstructionSet::baseline, driftwalk::InstructionSet::avx2,
                           driftwalk::InstructionSet::avx512}) {
      if (driftwalk::is_available(set)) {
        names.emplace_back(driftwalk::name(set));
      }
    }
    return names;
  });
}
