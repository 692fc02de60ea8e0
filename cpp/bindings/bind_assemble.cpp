// Bindings of the self-assembly core.
#include "assembly_rules.hpp"
#include "pull.hpp"

#include "driftwalk/assembly/assemble.hpp"
#include "driftwalk/simulate/threads.hpp"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>

#include <cmath>

using namespace nb::literals;

namespace {

nb::tuple place_blocks(const Model& model, std::size_t blocks, In<std::uint64_t, 1> key,
                       int threads, Cells glued) {
  require_blocks(blocks);
  driftwalk::AssemblyRules rules = rules_of(model, blocks);
  set_glued(rules, glued);
  const std::size_t worlds = key.size();
  std::vector<double> start(worlds * blocks * 3);
  std::vector<std::int32_t> placed(worlds);
  {
    nb::gil_scoped_release release;
    driftwalk::run_tasks(static_cast<std::int64_t>(worlds), threads, [&] {
      return [&](std::int64_t world) {
        placed[static_cast<std::size_t>(world)] = driftwalk::place_blocks(
            rules, key.data()[world], start.data() + 3 * rules.blocks * world);
      };
    });
  }
  return nb::make_tuple(hand_out(std::move(start), {worlds, blocks, 3}),
                        hand_out(std::move(placed), {worlds}));
}

nb::dict assemble(const Model& model, In<double, 3> start, In<std::uint64_t, 1> key,
                  In<double, 1> drag_coefficient, In<double, 1> force_std, std::int64_t steps,
                  const std::string& latching, double connector_distance, double connector_axis,
                  double hidden_share, double stirring_length, bool incompressible,
                  double block_restitution, double block_friction, int sample_every, int threads,
                  const std::string& precision, const driftwalk::FaceRules* faces,
                  std::optional<In<double, 1>> flow_start, Cells glued, const Pull* pull,
                  const BondNumbers& bonds, std::size_t event_rows) {
  const std::size_t worlds = start.shape(0), blocks = start.shape(1);
  require_blocks(blocks);
  if (start.shape(2) != 3 || key.size() != worlds || drag_coefficient.size() != worlds ||
      force_std.size() != worlds) {
    throw std::invalid_argument("start must have shape (worlds, blocks, 3); key, drag_coefficient "
                                "and force_std one entry per world");
  }
  if (steps < 1 || steps >= INT32_MAX || sample_every < 0) {
    throw std::invalid_argument("steps must be 1 to 2^31 - 2, sample_every not negative");
  }
  driftwalk::AssemblyRules rules = rules_of(model, blocks);
  rules.latching = latching_of(latching);
  rules.connector_distance = connector_distance;
  rules.connector_cosine = std::cos(connector_axis);
  set_shared(rules, hidden_share, stirring_length, incompressible);
  set_bonds(rules, bonds);
  rules.restitution = block_restitution;
  rules.friction = block_friction;
  set_glued(rules, glued);
  if (pull != nullptr) {
    rules.pull = pull->rules();
  }
  set_faces(rules, faces);
  const driftwalk::AssemblyWorlds batch{static_cast<std::int64_t>(worlds),
                                        steps,
                                        start.data(),
                                        drag_coefficient.data(),
                                        force_std.data(),
                                        key.data(),
                                        starts_of(flow_start, worlds)};
  const std::size_t least = blocks > 1 ? blocks - 1 : 1;
  const std::size_t events = rules.bonds_break && event_rows > least ? event_rows : least;
  const std::size_t samples =
      sample_every > 0 ? static_cast<std::size_t>(steps / sample_every + 1) : 0;
  std::vector<std::uint32_t> status(worlds);
  std::vector<std::int32_t> event_count(worlds), event_step(worlds * events, -1),
      event_block(worlds * events * 2, -1), event_face(worlds * events * 2, -1),
      event_kind(rules.bonds_break ? worlds * events : 0, -1), first_contact(worlds),
      end_step(worlds), cell(worlds * blocks * 2), quarter(worlds * blocks), root(worlds * blocks),
      sample_assembly(worlds * samples * blocks);
  std::vector<double> pose(worlds * blocks * 3);
  std::vector<float> sample_pose(worlds * samples * blocks * 3);
  driftwalk::AssemblyOutputs out;
  out.status = status.data();
  out.event_count = event_count.data();
  out.event_step = event_step.data();
  out.event_kind = rules.bonds_break ? event_kind.data() : nullptr;
  out.event_block = event_block.data();
  out.event_face = event_face.data();
  out.first_contact_step = first_contact.data();
  out.end_step = end_step.data();
  out.pose = pose.data();
  out.cell = cell.data();
  out.quarter = quarter.data();
  out.assembly = root.data();
  out.event_rows = static_cast<int>(events);
  out.sample_every = sample_every;
  out.samples = static_cast<std::int64_t>(samples);
  out.sample_pose = sample_pose.data();
  out.sample_assembly = sample_assembly.data();
  std::int64_t block_steps = 0;
  const bool twice = is_first(precision, "double", "single");
  if (worlds > 0) {
    nb::gil_scoped_release release;
    block_steps = twice ? driftwalk::assemble_batch(model.twice(), rules, batch, threads, out)
                        : driftwalk::assemble_batch(model.single(), rules, batch, threads, out);
  }
  nb::dict result;
  result["status"] = hand_out(std::move(status), {worlds});
  result["event_count"] = hand_out(std::move(event_count), {worlds});
  result["event_step"] = hand_out(std::move(event_step), {worlds, events});
  if (rules.bonds_break) {
    result["event_kind"] = hand_out(std::move(event_kind), {worlds, events});
  }
  result["event_block"] = hand_out(std::move(event_block), {worlds, events, 2});
  result["event_face"] = hand_out(std::move(event_face), {worlds, events, 2});
  result["first_contact_step"] = hand_out(std::move(first_contact), {worlds});
  result["end_step"] = hand_out(std::move(end_step), {worlds});
  result["pose"] = hand_out(std::move(pose), {worlds, blocks, 3});
  result["cell"] = hand_out(std::move(cell), {worlds, blocks, 2});
  result["quarter"] = hand_out(std::move(quarter), {worlds, blocks});
  result["assembly"] = hand_out(std::move(root), {worlds, blocks});
  result["block_steps"] = block_steps;
  if (sample_every > 0) {
    result["sample_pose"] = hand_out(std::move(sample_pose), {worlds, samples, blocks, 3});
    result["sample_assembly"] = hand_out(std::move(sample_assembly), {worlds, samples, blocks});
  }
  return result;
}

} // namespace

void register_assemble(nb::module_& module);
void register_assemble(nb::module_& module) {
  register_pull(module);
  module.def("place_blocks", &place_blocks, "model"_a, nb::kw_only(), "blocks"_a, "key"_a,
             "threads"_a, "glued"_a = nb::none());
  module.def("assemble", &assemble, "model"_a, nb::kw_only(), "start"_a, "key"_a,
             "drag_coefficient"_a, "force_std"_a, "steps"_a, "latching"_a, "connector_distance"_a,
             "connector_axis"_a, "hidden_share"_a, "stirring_length"_a, "incompressible"_a,
             "block_restitution"_a, "block_friction"_a, "sample_every"_a, "threads"_a,
             "precision"_a, "faces"_a.none() = nb::none(), "flow_start"_a = nb::none(),
             "glued"_a = nb::none(), "pull"_a = nb::none(), "bonds"_a = BondNumbers{0, 0, 0, 1.25},
             "event_rows"_a = 0);
}
