#include "driftwalk/assembly/live.hpp"

#include "driftwalk/assembly/assemble.hpp"
#include "driftwalk/assembly/memory.hpp"
#include "driftwalk/assembly/pack.hpp"
#include "driftwalk/physics/laws/mixed.hpp"

#include <algorithm>
#include <array>

namespace driftwalk {

namespace {
// The law that the study says: a world that is looked at can afford to ask at each strip.
struct EitherDrag {
  MixedDrag<double> mixed;
  bool is_quadratic;

  static EitherDrag of(double drag_coefficient, const DragShape<double>& shape) {
    return {MixedDrag<double>::of(drag_coefficient, shape), shape.is_quadratic};
  }
  double strength(double drag_coefficient) const {
    return is_quadratic ? QuadraticDrag{}.strength(drag_coefficient)
                        : mixed.strength(drag_coefficient);
  }
  double conductance(double closing, double slip) const {
    return is_quadratic ? QuadraticDrag{}.conductance(closing) : mixed.conductance(closing, slip);
  }
};

void put_drag_coefficient(EitherDrag& law, int, double value) {
  law.mixed.quadratic = value;
}

using OneWorld = WorldPack<double, double, EitherDrag>;

// Of one call of `advance`: where the next step might have more, it stops. A block has four bonds.
constexpr int most_step_events = 8 * most_blocks;
constexpr int most_events = 2 * most_step_events;
} // namespace

struct LiveWorld::Inside {
  Inside(const PreparedRun<double>& model, const AssemblyRules& given, const double* start,
         std::uint64_t own_key, double flow_start)
      : run(model.view()), rules(given), key(own_key),
        memory(most_blocks, PackMemory<double>::bytes(most_blocks)), out(outputs()),
        pack(run, rules, start, out, memory.scratch(), most_blocks) {
    pack.begin(0, 0, 0, start, key, flow_start);
  }

  AssemblyOutputs outputs() {
    AssemblyOutputs found;
    found.event_rows = most_events;
    found.event_step = event_step.data();
    found.event_kind = event_kind.data();
    found.event_block = event_block.data();
    found.event_face = event_face.data();
    return found;
  }

  Scene& filled_scene() {
    Scene& scene = memory.scratch().scene;
    fill_scene(rules, pack.memory(), 0, pack.book(0).assemblies, scene);
    return scene;
  }

  // Takes over what has been changed in the scene; everything else stays as it is, to the bit.
  void take_scene(const Scene& scene) {
    rules.blocks = scene.blocks;
    for (int b = 0; b < scene.blocks; ++b) {
      if (scene.assembly[scene.block[b].assembly].touched) {
        read_block(rules, scene, pack.memory(), b, 0);
      }
    }
    pack.book(0).assemblies = scene.assemblies;
    pack.renew();
  }

  // Every block is of its first kind again.
  void begin_kinds() {
    for (int b = 0; b < rules.blocks; ++b) {
      pack.memory().book(b, 0).kind = first_kind(rules.faces, b);
      set_poles(rules, pack.memory(), b, 0);
    }
  }

  void add_blocks(int wanted) {
    const std::int64_t interval = step / run.steps_per_interval;
    std::array<double, 3 * most_blocks> pose;
    for (int b = 0; b < rules.blocks; ++b) {
      read_pose(b, &pose[3 * static_cast<std::size_t>(b)]);
    }
    while (rules.blocks < wanted &&
           place_one_more(rules, key, interval, rules.blocks, pose.data())) {
      const int block = rules.blocks++;
      load_block<double, double>(rules, &pose[3 * static_cast<std::size_t>(block)], pack.memory(),
                                 block, 0);
      pack.draw_again(block);
      ++pack.book(0).assemblies;
    }
    pack.renew();
  }

  void read_pose(int block, double* pose) const {
    const Member<double>& m = pack.memory().members[block];
    pose[0] = m.x;
    pose[1] = m.y;
    pose[2] = own_angle<double, double>(pack.memory(), block, 0);
  }

  const Prepared<double>& run;
  AssemblyRules rules;
  bool poles_repel = false; // by what was given with the forces
  std::uint64_t key;
  std::array<std::int32_t, most_events> event_step, event_kind;
  std::array<std::int32_t, 2 * most_events> event_block, event_face;
  AssemblyMemory memory;
  AssemblyOutputs out;
  OneWorld pack;
  std::int64_t step = 0;
};

LiveWorld::LiveWorld(const PreparedRun<double>& run, const AssemblyRules& rules,
                     const LiveForces& forces, const double* start, std::uint64_t key,
                     double flow_start)
    : inside_(std::make_unique<Inside>(run, rules, start, key, flow_start)) {
  set_forces(forces);
}

LiveWorld::~LiveWorld() = default;

void LiveWorld::advance(std::int64_t steps) {
  inside_->pack.book(0).event_count = 0;
  const int most = most_events - most_step_events;
  for (const std::int64_t end = inside_->step + steps;
       inside_->step < end && inside_->pack.book(0).event_count <= most; ++inside_->step) {
    inside_->pack.step(inside_->step);
  }
}

void LiveWorld::set_forces(const LiveForces& forces) {
  inside_->pack.set_forces(0, forces.drag_coefficient, forces.force_std);
  inside_->pack.scale_flow(forces.flow_scale);
}

void LiveWorld::set_rules(Latching latching, double hidden_share, double stirring_length) {
  AssemblyRules& rules = inside_->rules;
  rules.latching = latching;
  rules.hidden_share = hidden_share;
  rules.stirring_length = stirring_length;
  for (int b = 0; b < rules.blocks; ++b) {
    cover_faces(rules, inside_->pack.memory(), b, 0);
  }
  inside_->pack.renew();
}

void LiveWorld::set_bonds(double rate, double relatch_clearance) {
  AssemblyRules& rules = inside_->rules;
  const bool began = !rules.bonds_break && rate > 0;
  rules.bond_rate = rate;
  rules.relatch_clearance = relatch_clearance;
  rules.bonds_break = rate > 0 || rules.bond_strength > 0;
  if (began) {
    inside_->pack.bond_anew(inside_->step, 0);
  } else if (!rules.bonds_break) {
    inside_->pack.book(0).bonds.count = 0;
  }
}

void LiveWorld::set_faces(const FaceRules* faces) {
  inside_->rules.faces = faces;
  inside_->rules.pull.like_poles_repel = inside_->poles_repel || faces != nullptr;
  inside_->begin_kinds();
}

void LiveWorld::set_pull(const PullRules& pull) {
  inside_->rules.pull = pull;
  inside_->poles_repel = pull.like_poles_repel;
  inside_->rules.pull.like_poles_repel = pull.like_poles_repel || inside_->rules.faces != nullptr;
  for (int b = 0; b < inside_->rules.blocks; ++b) {
    set_poles(inside_->rules, inside_->pack.memory(), b, 0);
  }
  inside_->pack.renew();
}

int LiveWorld::set_blocks(int blocks) {
  blocks = std::clamp(blocks, 1, most_blocks);
  if (blocks < inside_->rules.blocks) {
    Scene& scene = inside_->filled_scene();
    keep_first_blocks(inside_->rules, scene, blocks);
    inside_->take_scene(scene);
    drop_bonds(scene, inside_->pack.book(0).bonds);
  } else if (blocks > inside_->rules.blocks) {
    inside_->add_blocks(blocks);
  }
  return inside_->rules.blocks;
}

void LiveWorld::part() {
  Scene& scene = inside_->filled_scene();
  part_blocks(inside_->rules, scene);
  inside_->take_scene(scene);
  inside_->pack.book(0).bonds.count = 0;
  inside_->begin_kinds();
}

int LiveWorld::blocks() const {
  return inside_->rules.blocks;
}

std::int64_t LiveWorld::step() const {
  return inside_->step;
}

std::uint32_t LiveWorld::status() const {
  return lane_status<double, double>(inside_->run, inside_->rules, inside_->pack.memory(), 0);
}

LiveEvents LiveWorld::events() const {
  return {inside_->pack.book(0).event_count, inside_->event_step.data(),
          inside_->rules.bonds_break ? inside_->event_kind.data() : nullptr,
          inside_->event_block.data(), inside_->event_face.data()};
}

void LiveWorld::read(const LiveBlocks& out) const {
  read_blocks<double, double>(inside_->rules, inside_->pack.memory(), 0, out);
}

const BondList& LiveWorld::bonds() const {
  return inside_->pack.book(0).bonds;
}

} // namespace driftwalk
