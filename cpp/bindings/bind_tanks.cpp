// Bindings of a batch of worlds that keep their state.
#include "assembly_rules.hpp"
#include "pull.hpp"

#include "driftwalk/assembly/tank_batch.hpp"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <cmath>
#include <limits>

using namespace nb::literals;

namespace {

using driftwalk::TankBatch;

template <class T>
std::vector<T> checked(const nb::ndarray<const T, nb::c_contig, nb::device::cpu>& values,
                       std::size_t size, const char* name) {
  if (values.size() != size) {
    throw std::invalid_argument(std::string(name) + " has a wrong number of entries");
  }
  return std::vector<T>(values.data(), values.data() + size);
}

void start_batch(TankBatch* self, const std::vector<const Model*>& models, In<double, 3> start,
                 In<std::uint64_t, 1> key, const std::string& precision, double connector_distance,
                 double connector_axis, double hidden_share, double stirring_length,
                 bool incompressible, double block_restitution, double block_friction,
                 const driftwalk::FaceRules* faces, const BondNumbers& bonds, const Pull* pull,
                 Cells glued, const std::vector<std::optional<In<double, 1>>>& flow_start,
                 const std::optional<nb::dict>& joined, int threads) {
  const std::size_t worlds = start.shape(0), blocks = start.shape(1), rows = worlds * blocks;
  require_blocks(blocks);
  if (start.shape(2) != 3 || key.size() != worlds || worlds == 0 || models.empty() ||
      flow_start.size() != models.size()) {
    throw std::invalid_argument("start must have shape (worlds, blocks, 3), key one entry per "
                                "world, flow_start one per model");
  }
  const bool twice = is_first(precision, "double", "single");
  std::vector<driftwalk::TankFlow> flows(models.size());
  for (std::size_t k = 0; k < models.size(); ++k) {
    driftwalk::TankFlow& flow = flows[k];
    flow.single = twice ? nullptr : &models[k]->single();
    flow.twice = twice ? &models[k]->twice() : nullptr;
    flow.rules = rules_of(*models[k], blocks);
    flow.rules.connector_distance = connector_distance;
    flow.rules.connector_cosine = std::cos(connector_axis);
    set_shared(flow.rules, hidden_share, stirring_length, incompressible);
    set_bonds(flow.rules, bonds);
    flow.rules.restitution = block_restitution;
    flow.rules.friction = block_friction;
    set_glued(flow.rules, glued);
    if (pull != nullptr) {
      flow.rules.pull = pull->rules();
    }
    set_faces(flow.rules, faces);
    if (const double* const starts = starts_of(flow_start[k], worlds)) {
      flow.start.assign(starts, starts + worlds);
    }
  }
  std::vector<double> velocity;
  std::vector<std::int32_t> assembly, cell, quarter, kind;
  const auto read = [&](const char* name, auto& into, std::size_t size) {
    using T = typename std::remove_reference_t<decltype(into)>::value_type;
    into = checked<T>(
        nb::cast<nb::ndarray<const T, nb::c_contig, nb::device::cpu>>((*joined)[name]), size, name);
  };
  driftwalk::LiveBlocks as_joined{};
  if (joined) {
    read("velocity", velocity, 3 * rows);
    read("assembly", assembly, rows);
    read("cell", cell, 2 * rows);
    read("quarter", quarter, rows);
    read("kind", kind, rows);
    for (std::size_t b = 0; b < rows; ++b) {
      const std::size_t first = b / blocks * blocks;
      const std::size_t lowest = first + static_cast<std::size_t>(assembly[b]);
      if (assembly[b] < 0 || lowest > b || assembly[lowest] != assembly[b] || kind[b] < 0 ||
          kind[b] > 255) {
        throw std::invalid_argument("assembly must be the lowest block of each block's assembly");
      }
      quarter[b] &= 3;
    }
    as_joined = {nullptr,     velocity.data(), assembly.data(),
                 cell.data(), quarter.data(),  kind.data()};
  }
  std::vector<std::uint64_t> keys(key.data(), key.data() + worlds);
  nb::gil_scoped_release release;
  new (self) TankBatch(std::move(flows), std::move(keys), start.data(),
                       joined ? &as_joined : nullptr, threads);
}

void advance(TankBatch& batch, std::int64_t steps, In<std::int32_t, 1> flow,
             In<std::int32_t, 1> latching, In<double, 1> flow_scale, In<double, 1> drag_coefficient,
             In<double, 1> force_std, int threads) {
  const std::size_t worlds = static_cast<std::size_t>(batch.worlds());
  if (flow.size() != worlds || latching.size() != worlds || flow_scale.size() != worlds ||
      drag_coefficient.size() != worlds || force_std.size() != worlds) {
    throw std::invalid_argument("settings must have one entry per world");
  }
  for (std::size_t w = 0; w < worlds; ++w) {
    if (flow.data()[w] < -1 || flow.data()[w] >= batch.flows() || latching.data()[w] < 0 ||
        latching.data()[w] > 2) {
      throw std::invalid_argument("there is no such flow, or way of latching");
    }
  }
  if (steps < 0 || steps >= std::numeric_limits<std::int32_t>::max() - batch.step()) {
    throw std::invalid_argument("a world has at most 2^31 - 2 steps");
  }
  nb::gil_scoped_release release;
  batch.advance(
      {flow.data(), latching.data(), flow_scale.data(), drag_coefficient.data(), force_std.data()},
      steps, threads);
}

TankBatch take(const TankBatch& batch, const std::vector<std::int64_t>& world,
               In<std::uint64_t, 1> key) {
  for (const std::int64_t w : world) {
    if (w < 0 || w >= batch.worlds()) {
      throw std::invalid_argument("there is no such world");
    }
  }
  if (key.size() != world.size() || world.empty()) {
    throw std::invalid_argument("take at least one world, and one key for each");
  }
  return batch.take(world, std::vector<std::uint64_t>(key.data(), key.data() + key.size()));
}

nb::dict state(const TankBatch& batch) {
  const std::size_t worlds = static_cast<std::size_t>(batch.worlds());
  const std::size_t blocks = static_cast<std::size_t>(batch.blocks());
  const auto copy = [](const auto& values) { return values; };
  nb::dict out;
  out["pose"] = hand_out(copy(batch.pose()), {worlds, blocks, 3});
  out["velocity"] = hand_out(copy(batch.velocity()), {worlds, blocks, 3});
  out["assembly"] = hand_out(copy(batch.assembly()), {worlds, blocks});
  out["cell"] = hand_out(copy(batch.cell()), {worlds, blocks, 2});
  out["quarter"] = hand_out(copy(batch.quarter()), {worlds, blocks});
  out["kind"] = hand_out(copy(batch.kind()), {worlds, blocks});
  return out;
}

} // namespace

void register_tanks(nb::module_& module);
void register_tanks(nb::module_& module) {
  nb::class_<TankBatch>(module, "TankBatch")
      .def("__init__", &start_batch, "models"_a, nb::kw_only(), "start"_a, "key"_a, "precision"_a,
           "connector_distance"_a, "connector_axis"_a, "hidden_share"_a, "stirring_length"_a,
           "incompressible"_a, "block_restitution"_a, "block_friction"_a, "faces"_a.none(),
           "bonds"_a, "pull"_a.none(), "glued"_a.none(), "flow_start"_a, "joined"_a.none(),
           "threads"_a)
      .def("advance", &advance, "steps"_a, nb::kw_only(), "flow"_a, "latching"_a, "flow_scale"_a,
           "drag_coefficient"_a, "force_std"_a, "threads"_a)
      .def("take", &take, "worlds"_a, "key"_a)
      .def("state", &state)
      .def_prop_ro("step", &TankBatch::step)
      .def("status",
           [](const TankBatch& batch) {
             return hand_out(std::vector(batch.status()), {batch.status().size()});
           })
      .def("last_event", [](const TankBatch& batch) {
        return hand_out(std::vector(batch.last_event()), {batch.last_event().size()});
      });
}
