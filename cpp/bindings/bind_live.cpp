// Bindings of the live world: a world that keeps its state between calls.
#include "assembly_rules.hpp"
#include "pull.hpp"

#include "driftwalk/assembly/live.hpp"

#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>

#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

using namespace nb::literals;

namespace {

using driftwalk::LiveForces;
using driftwalk::LiveWorld;

void start_world(LiveWorld* self, const Model& model, In<double, 2> start, std::uint64_t key,
                 double drag_coefficient, double force_std, const std::string& latching,
                 double connector_distance, double connector_axis, double hidden_share,
                 double stirring_length, bool incompressible, double block_restitution,
                 double block_friction, const driftwalk::FaceRules* faces, double flow_start,
                 const BondNumbers& bonds) {
  require_blocks(start.shape(0));
  if (start.shape(1) != 3) {
    throw std::invalid_argument("start must have shape (blocks, 3)");
  }
  driftwalk::AssemblyRules rules = rules_of(model, start.shape(0));
  rules.latching = latching_of(latching);
  rules.connector_distance = connector_distance;
  rules.connector_cosine = std::cos(connector_axis);
  set_shared(rules, hidden_share, stirring_length, incompressible);
  set_bonds(rules, bonds);
  rules.restitution = block_restitution;
  rules.friction = block_friction;
  rules.faces = faces;
  new (self) LiveWorld(model.twice(), rules, {drag_coefficient, force_std, 1.0}, start.data(), key,
                       flow_start);
}

nb::dict advance(LiveWorld& world, std::int64_t steps) {
  if (steps < 0 || steps >= INT32_MAX - world.step()) {
    throw std::invalid_argument("a world has at most 2^31 - 2 steps");
  }
  {
    nb::gil_scoped_release release;
    world.advance(steps);
  }
  const driftwalk::LiveEvents events = world.events();
  const std::size_t count = static_cast<std::size_t>(events.count);
  const auto rows = [&](const std::int32_t* values, std::size_t width) {
    return std::vector<std::int32_t>(values, values + count * width);
  };
  nb::dict out;
  out["step"] = hand_out(rows(events.step, 1), {count});
  out["kind"] = hand_out(
      events.kind == nullptr ? std::vector<std::int32_t>(count) : rows(events.kind, 1), {count});
  out["block"] = hand_out(rows(events.block, 2), {count, 2});
  out["face"] = hand_out(rows(events.face, 2), {count, 2});
  return out;
}

nb::dict state(const LiveWorld& world) {
  const std::size_t blocks = static_cast<std::size_t>(world.blocks());
  std::vector<double> pose(blocks * 3), velocity(blocks * 3);
  std::vector<std::int32_t> assembly(blocks), cell(blocks * 2), quarter(blocks), kind(blocks);
  world.read(
      {pose.data(), velocity.data(), assembly.data(), cell.data(), quarter.data(), kind.data()});
  nb::dict out;
  out["pose"] = hand_out(std::move(pose), {blocks, 3});
  out["velocity"] = hand_out(std::move(velocity), {blocks, 3});
  out["assembly"] = hand_out(std::move(assembly), {blocks});
  out["cell"] = hand_out(std::move(cell), {blocks, 2});
  out["quarter"] = hand_out(std::move(quarter), {blocks});
  std::vector<std::int32_t> pairs;
  const driftwalk::BondList& bonds = world.bonds();
  for (int k = 0; k < bonds.count; ++k) {
    if (bonds.bond[k].state == driftwalk::BondState::whole) {
      pairs.insert(pairs.end(), {bonds.bond[k].first, bonds.bond[k].second});
    }
  }
  const std::size_t count = pairs.size() / 2;
  out["bond"] = hand_out(std::move(pairs), {count, 2});
  out["kind"] = hand_out(std::move(kind), {blocks});
  return out;
}

int set_blocks(LiveWorld& world, std::size_t blocks) {
  require_blocks(blocks);
  nb::gil_scoped_release release;
  return world.set_blocks(static_cast<int>(blocks));
}

} // namespace

void register_live(nb::module_& module);
void register_live(nb::module_& module) {
  nb::class_<LiveWorld>(module, "LiveWorld")
      .def("__init__", &start_world, nb::keep_alive<1, 2>(), nb::keep_alive<1, 15>(), "model"_a,
           nb::kw_only(), "start"_a, "key"_a, "drag_coefficient"_a, "force_std"_a, "latching"_a,
           "connector_distance"_a, "connector_axis"_a, "hidden_share"_a, "stirring_length"_a,
           "incompressible"_a, "block_restitution"_a, "block_friction"_a,
           "faces"_a.none() = nb::none(), "flow_start"_a = 0.0,
           "bonds"_a = BondNumbers{0, 0, 0, 1.25})
      .def("advance", &advance, "steps"_a)
      .def("state", &state)
      .def(
          "set_forces",
          [](LiveWorld& world, double drag_coefficient, double force_std, double flow_scale) {
            world.set_forces({drag_coefficient, force_std, flow_scale});
          },
          nb::kw_only(), "drag_coefficient"_a, "force_std"_a, "flow_scale"_a)
      .def(
          "set_rules",
          [](LiveWorld& world, const std::string& latching, double hidden_share,
             double stirring_length) {
            driftwalk::AssemblyRules checked;
            set_shared(checked, hidden_share, stirring_length, false);
            world.set_rules(latching_of(latching), hidden_share, stirring_length);
          },
          nb::kw_only(), "latching"_a, "hidden_share"_a, "stirring_length"_a)
      .def("set_faces", &LiveWorld::set_faces, nb::keep_alive<1, 2>(), "faces"_a.none())
      .def(
          "set_bonds",
          [](LiveWorld& world, double rate, double relatch_clearance) {
            driftwalk::AssemblyRules checked;
            set_bonds(checked, {rate, 0, 0, relatch_clearance});
            world.set_bonds(rate, relatch_clearance);
          },
          nb::kw_only(), "rate"_a, "relatch_clearance"_a)
      .def(
          "set_pull",
          [](LiveWorld& world, const Pull* pull) {
            world.set_pull(pull == nullptr ? driftwalk::PullRules{} : pull->rules());
          },
          nb::keep_alive<1, 2>(), "pull"_a.none())
      .def("set_blocks", &set_blocks, "blocks"_a)
      .def("part", &LiveWorld::part)
      .def_prop_ro("step", &LiveWorld::step)
      .def_prop_ro("status", &LiveWorld::status);
}
