// The core of the playground for WebAssembly: live worlds, the steps of their blocks and the KS
// distance, as functions of plain numbers and of arrays in the module's memory. web/src/local calls
// them; .ci/wasm builds the module.
#include "driftwalk/assembly/assemble.hpp"
#include "driftwalk/assembly/live.hpp"
#include "driftwalk/dispatch.hpp"
#include "driftwalk/stats/ks2d.hpp"
#include "driftwalk/stats/ks2d_permutation.hpp"
#include "driftwalk/stats/steps.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <iterator>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

// A function of the module.
#define EXPORT(name) extern "C" __attribute__((export_name(#name)))

namespace driftwalk {
// There is one.
InstructionSet chosen_instruction_set() {
  return InstructionSet::baseline;
}
} // namespace driftwalk

namespace {
using namespace driftwalk;

// Arrays of a model in the order of web/src/local/core.ts, each with its number of entries.
struct Array {
  const double* data;
  std::int32_t size;

  int rows(int width) const { return size / width; }
};
struct ModelArrays {
  Array u, v, frame_time, edges, panels, corners, moment_points;
  std::int32_t rows, columns, repeat;
};

// A model, prepared, and what the rules take from it.
struct Run {
  explicit Run(const BatchModel& model)
      : prepared(model), mass(model.mass), inertia(model.inertia) {}

  PreparedRun<double> prepared;
  double mass, inertia;
};

// How blocks collide and latch, as the arguments of Python's LiveWorld.
struct Rules {
  double latching, connector_distance, connector_cosine, hidden_share, stirring_length;
  double incompressible, block_restitution, block_friction;
  double bond_rate, bond_force, bond_strength, relatch_clearance;
};

AssemblyRules rules_of(const Run& run, const Rules& given, int blocks) {
  AssemblyRules rules;
  const Prepared<double>& view = run.prepared.view();
  rules.blocks = blocks;
  rules.side = 2 * view.block.half_side;
  rules.round = view.shape.disc_radius > 0;
  rules.width = 2 * view.shape.half_width;
  rules.mass = run.mass;
  rules.inertia = run.inertia;
  rules.radius = view.wall.radius;
  rules.edges = view.wall.edges;
  rules.edge_count = view.wall.edge_count;
  rules.low_x = view.flow.low_x;
  rules.high_x = view.flow.high_x;
  rules.low_y = view.flow.low_y;
  rules.high_y = view.flow.high_y;
  rules.bounce_speed = view.wall.bounce_speed;
  rules.latching = static_cast<Latching>(static_cast<int>(given.latching));
  rules.connector_distance = given.connector_distance;
  rules.connector_cosine = given.connector_cosine;
  rules.hidden_share = given.hidden_share;
  rules.stirring_length = given.stirring_length;
  rules.incompressible = given.incompressible != 0;
  rules.restitution = given.block_restitution;
  rules.friction = given.block_friction;
  rules.bond_rate = given.bond_rate;
  rules.bond_force = given.bond_force;
  rules.bond_strength = given.bond_strength;
  rules.relatch_clearance = given.relatch_clearance;
  rules.bonds_break = rules.bond_rate > 0 || rules.bond_strength > 0;
  return rules;
}

// The blocks of a world as they were read last; columns have room for all blocks.
struct State {
  double pose[3 * most_blocks], velocity[3 * most_blocks];
  std::int32_t assembly[most_blocks], cell[2 * most_blocks], quarter[most_blocks],
      kind[most_blocks];
};

struct World {
  World(const Run& run, const AssemblyRules& rules, const double* start, std::uint64_t key,
        double flow_start)
      : live(run.prepared, rules, {}, start, key, flow_start) {}

  LiveWorld live;
  State state;
};

// A table of forces between blocks, which keeps its numbers.
struct Pull {
  std::vector<float> oriented;
  std::vector<double> twice[3];
  PullRules rules;
};

struct Reference {
  KsReference sorted;
  KsWorkspace workspace;
};
} // namespace

EXPORT(allocate) void* allocate(std::size_t bytes) {
  return std::malloc(bytes);
}
EXPORT(release) void release(void* memory) {
  std::free(memory);
}

// The names of a model's numbers with a comma behind each, in the order of `make_run`.
EXPORT(number_names) const char* number_names() {
  static const std::string names = [] {
    std::string all;
    each_model_number(
        [&](const char* name, const char*, Range, auto) { all += std::string(name) + ","; });
    return all;
  }();
  return names.c_str();
}

EXPORT(make_run) Run* make_run(const double* numbers, const ModelArrays* arrays) {
  BatchModel model{};
  each_model_number([&](const char*, const char*, Range, auto field) {
    model.*field = static_cast<std::remove_reference_t<decltype(model.*field)>>(*numbers++);
  });
  static constexpr double start[1] = {0};
  model.edges = arrays->edges.data;
  model.edge_count = arrays->edges.rows(3);
  model.panels = arrays->panels.size > 0 ? arrays->panels.data : nullptr;
  model.panel_count = arrays->panels.rows(5);
  model.corners = model.panels == nullptr ? nullptr : arrays->corners.data;
  model.corner_count = arrays->corners.rows(2);
  model.moment_points = model.panels == nullptr ? nullptr : arrays->moment_points.data;
  model.moment_point_count = arrays->moment_points.rows(3);
  model.flow_u = arrays->u.data;
  model.flow_v = arrays->v.data;
  model.frames = arrays->frame_time.size;
  model.rows = arrays->rows;
  model.columns = arrays->columns;
  model.frame_time = arrays->frame_time.data;
  model.repeat = static_cast<FlowRepeat>(arrays->repeat);
  model.sample_time = start;
  model.samples = 1;
  return new Run(model);
}

// Random start poses; how many blocks found a place.
EXPORT(place)
int place(const Run* run, const Rules* given, int blocks, std::uint64_t key, double* start) {
  return place_blocks(rules_of(*run, *given, blocks), key, start);
}

EXPORT(make_world)
World* make_world(const Run* run, const Rules* given, int blocks, const double* start,
                  std::uint64_t key, double flow_start, const FaceRules* faces) {
  AssemblyRules rules = rules_of(*run, *given, blocks);
  rules.faces = faces;
  return new World(*run, rules, start, key, flow_start);
}
EXPORT(end_world) void end_world(World* world) {
  delete world;
}
EXPORT(advance) void advance(World* world, double steps) {
  world->live.advance(static_cast<std::int64_t>(steps));
}
EXPORT(step_of) double step_of(const World* world) {
  return static_cast<double>(world->live.step());
}
EXPORT(status_of) std::uint32_t status_of(const World* world) {
  return world->live.status();
}
EXPORT(blocks_of) int blocks_of(const World* world) {
  return world->live.blocks();
}
EXPORT(read) const State* read(World* world) {
  State& state = world->state;
  world->live.read(
      {state.pose, state.velocity, state.assembly, state.cell, state.quarter, state.kind});
  return &state;
}
EXPORT(set_forces)
void set_forces(World* world, double drag_coefficient, double force_std, double flow_scale) {
  world->live.set_forces({drag_coefficient, force_std, flow_scale});
}
EXPORT(set_rules) void set_rules(World* world, const Rules* rules) {
  world->live.set_rules(static_cast<Latching>(static_cast<int>(rules->latching)),
                        rules->hidden_share, rules->stirring_length);
  world->live.set_bonds(rules->bond_rate, rules->relatch_clearance);
}
EXPORT(set_faces) void set_faces(World* world, const FaceRules* faces) {
  world->live.set_faces(faces);
}
EXPORT(set_pull) void set_pull(World* world, const Pull* pull) {
  world->live.set_pull(pull == nullptr ? PullRules{} : pull->rules);
}
EXPORT(set_blocks) int set_blocks(World* world, int blocks) {
  return world->live.set_blocks(blocks);
}
EXPORT(part) void part(World* world) {
  world->live.part();
}

// Typed faces from tables of whole numbers: counts (kind), types and poles (kind, face), which
// types latch (type, type), and what a kind becomes (kind, face, type).
EXPORT(make_faces)
FaceRules* make_faces(int kinds, int types, const std::int32_t* count, const std::int32_t* type,
                      const std::int32_t* pole, const std::int32_t* latches,
                      const std::int32_t* becomes) {
  FaceRules* const rules = new FaceRules;
  rules->kinds = kinds;
  std::partial_sum(count, count + kinds, rules->ends);
  for (int k = 0; k < types * types; ++k) {
    rules->latches[k / types] |= static_cast<std::uint32_t>(latches[k]) << (k % types);
  }
  for (int k = 0; k < 4 * kinds; ++k) {
    rules->type[k / 4][k % 4] = static_cast<std::uint8_t>(type[k]);
    rules->pole[k / 4][k % 4] = static_cast<std::int8_t>(pole[k]);
    for (int t = 0; t < types; ++t) {
      rules->becomes[k / 4][k % 4][t] = static_cast<std::uint8_t>(becomes[types * k + t]);
    }
  }
  return rules;
}

EXPORT(make_pull)
Pull* make_pull(double reach, double lever, int like_poles_repel, int every, double near_fading,
                double near_end, double near_reach) {
  Pull* const pull = new Pull;
  pull->rules.on = true;
  pull->rules.reach = reach;
  pull->rules.lever = lever;
  pull->rules.like_poles_repel = like_poles_repel != 0;
  pull->rules.every = every;
  pull->rules.near_fading = near_fading;
  pull->rules.near_end = near_end;
  pull->rules.near_reach = near_reach;
  return pull;
}
// `what` is 0 for centres, 1 for resistance, 2 for faces.
EXPORT(set_radial)
void set_radial(Pull* pull, int what, const double* cells, int count, int first) {
  RadialTable* const tables[] = {&pull->rules.centres, &pull->rules.resistance, &pull->rules.faces};
  pull->twice[what].assign(cells, cells + 2 * count);
  *tables[what] = {nullptr, pull->twice[what].data(), count, first};
}
EXPORT(set_oriented)
void set_oriented(Pull* pull, const double* coefficient, int distances, int angles, double first,
                  double per_step, double low, double high) {
  pull->oriented.assign(coefficient, coefficient + distances * angles * angles);
  pull->rules.oriented = {pull->oriented.data(), distances, angles, first, per_step, low, high};
}
EXPORT(set_multipoles)
void set_multipoles(Pull* pull, const double* coefficient, double softening, double fading,
                    double end) {
  Multipoles& far = pull->rules.multipoles;
  far = {.on = true, .softening = softening, .fading = fading, .end = end};
  std::copy_n(coefficient, std::size(far.coefficient), far.coefficient);
}

// Steps between positions at equal times: lengths and turning angles of `count` positions at most.
EXPORT(form_steps)
int form_steps(const double* x, const double* y, int count, double* length, double* angle) {
  static std::vector<std::int32_t> whole;
  static std::vector<double> weight;
  if (count < 3) {
    return 0;
  }
  if (static_cast<int>(whole.size()) < count) {
    whole.resize(static_cast<std::size_t>(count));
    std::iota(whole.begin(), whole.end(), 0);
    weight.resize(whole.size());
  }
  const StepPlanView plan{whole.data(), weight.data(), whole.data(), count, count - 2};
  return static_cast<int>(apply_step_plan(plan, x, y, length, angle, nullptr));
}

EXPORT(make_reference) Reference* make_reference(const double* x, const double* y, int count) {
  return new Reference{KsReference(x, y, count), KsWorkspace()};
}
EXPORT(ks_distance)
double ks_distance(Reference* reference, const double* x, const double* y, int count) {
  return ks_two_sample(reference->sorted, x, y, count, reference->workspace).distance();
}
// D of one permutation of blocks, see `ks_permutations`; the samples have n1 and n2 points.
EXPORT(permuted_distance)
double permuted_distance(const double* x, const double* y, int n1, int n2,
                         const std::int32_t* block_of, int blocks, const std::uint8_t* labels) {
  std::int64_t statistic = 0;
  ks_permutations(x, y, n1, n2, block_of, blocks, labels, 1, KsTies::strict, &statistic);
  return static_cast<double>(statistic) / (2.0 * n1 * n2);
}
