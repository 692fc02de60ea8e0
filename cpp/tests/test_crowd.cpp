// Worlds of many blocks, whose blocks are in the lanes: the same bits as one world per lane, where
// all pairs are looked at; memory that grows with the blocks; lists that lose no pair.
#include "check.hpp"
#include "driftwalk/assembly/memory.hpp"
#include "driftwalk/assembly/run.hpp"
#include "driftwalk/physics/laws/quadratic.hpp"
#include "synthetic_assembly.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

namespace {

using driftwalk::AssemblyRules;
using driftwalk::Latching;
using driftwalk::QuadraticDrag;
using synthetic::Crowd;
using synthetic::Tank;
using Real = driftwalk::FloatPack<4>;

Tank stirred(double radius) {
  Tank tank;
  tank.model.radius = radius;
  tank.spacing = radius / 29;
  tank.model.friction = 0.3;
  tank.set_flow([&](double x, double y, double& u, double& v) {
    const double q = std::hypot(x, y) / radius, speed = 0.2 * q * (1.5 - q);
    u = -speed * y / radius - 0.1 * x / radius;
    v = speed * x / radius - 0.1 * y / radius;
  });
  return tank;
}

struct Found {
  std::vector<std::int32_t> count, step, block, face, cell, quarter, assembly, ends;
  std::vector<double> pose;

  bool operator==(const Found& other) const {
    return count == other.count && step == other.step && block == other.block &&
           face == other.face && cell == other.cell && quarter == other.quarter &&
           assembly == other.assembly && ends == other.ends &&
           std::memcmp(pose.data(), other.pose.data(), pose.size() * sizeof(double)) == 0;
  }
};

template <bool Crowded>
Found run(Tank& tank, const AssemblyRules& rules, const Crowd& crowd, std::int64_t steps) {
  const driftwalk::PreparedRun<float> prepared(tank.finished());
  const std::size_t worlds = crowd.worlds(), blocks = std::size_t(rules.blocks);
  const std::size_t rows = worlds * blocks;
  Found found;
  found.count.resize(worlds);
  found.ends.resize(worlds);
  found.step.assign(rows, -1);
  found.block.assign(2 * rows, -1);
  found.face.assign(2 * rows, -1);
  found.cell.resize(2 * rows);
  found.quarter.resize(rows);
  found.assembly.resize(rows);
  found.pose.resize(3 * rows);
  std::vector<std::uint32_t> status(worlds);
  std::vector<std::int32_t> contact(worlds);
  driftwalk::AssemblyWorlds input;
  input.count = std::int64_t(worlds);
  input.steps = steps;
  input.start = crowd.start.data();
  input.drag_coefficient = crowd.drag_coefficient.data();
  input.force_std = crowd.force_std.data();
  input.key = crowd.key.data();
  driftwalk::AssemblyOutputs out;
  out.status = status.data();
  out.event_count = found.count.data();
  out.event_step = found.step.data();
  out.event_block = found.block.data();
  out.event_face = found.face.data();
  out.first_contact_step = contact.data();
  out.end_step = found.ends.data();
  out.pose = found.pose.data();
  out.cell = found.cell.data();
  out.quarter = found.quarter.data();
  out.assembly = found.assembly.data();
  out.event_rows = rules.blocks;
  std::int64_t next = 0;
  const driftwalk::WorldQueue queue{
      [](void* self) { return (*static_cast<std::int64_t*>(self))++; }, &next};
  driftwalk::AssemblyMemory memory(rules.blocks,
                                   driftwalk::PackMemory<Real>::bytes_of(rules.blocks, Crowded));
  driftwalk::AssemblyPack<Real, float, QuadraticDrag, Crowded>(prepared.view(), rules, input, out,
                                                               queue, memory.scratch())
      .run();
  return found;
}

// Near pairs in lists, sums over lists of members, walls row by row: as by brute force.
void check_against_all_pairs(int blocks, Latching latching, int worlds, std::int64_t steps) {
  Tank tank = stirred(0.03 * std::sqrt(1.2 * blocks));
  const driftwalk::PreparedRun<double> prepared(tank.finished());
  AssemblyRules rules = synthetic::rules_in(prepared, blocks);
  rules.latching = latching;
  Crowd crowd(blocks);
  for (std::uint64_t k = 0; int(crowd.worlds()) < worlds; ++k) {
    crowd.add_random(rules, k, 0.45, 2e-3);
  }
  const Found lists = run<true>(tank, rules, crowd, steps);
  CHECK(lists == run<false>(tank, rules, crowd, steps));
  const int most = *std::max_element(lists.count.begin(), lists.count.end());
  std::printf("%d blocks: %d joinings, the same bits as by brute force\n", blocks, most);
  CHECK((most > blocks / 4) == (latching != Latching::none));
}

// Blocks all in one place are more pairs than the room that a world begins with.
void check_growing_list() {
  constexpr int blocks = 300;
  Tank tank = stirred(1);
  const driftwalk::PreparedRun<double> prepared(tank.finished());
  const AssemblyRules rules = synthetic::rules_in(prepared, blocks);
  driftwalk::AssemblyMemory memory(blocks, 64);
  driftwalk::Scene& scene = memory.scratch().scene;
  scene.blocks = blocks;
  for (int b = 0; b < blocks; ++b) {
    scene.block[b] = {};
    scene.block[b].assembly = b;
    scene.block[b].x = 1e-6 * b;
  }
  CHECK(scene.pairs.room < driftwalk::pair_capacity(blocks));
  driftwalk::find_pairs(rules, scene);
  CHECK(scene.pairs.count == driftwalk::pair_capacity(blocks));
  int k = 0;
  for (int a = 0; a < blocks; ++a) {
    for (int b = a + 1; b < blocks; ++b, ++k) {
      CHECK(scene.pairs.pair[k].first == a && scene.pairs.pair[k].second == b);
    }
  }
  // What is of one assembly is no pair.
  for (int b = 0; b < blocks; ++b) {
    scene.block[b].assembly = b % 2;
  }
  driftwalk::find_pairs(rules, scene);
  CHECK(scene.pairs.count == (blocks / 2) * (blocks / 2));
}

void check_memory() {
  const auto of = [](int blocks) {
    driftwalk::AssemblyMemory memory(blocks, 64);
    return driftwalk::PackMemory<driftwalk::FloatPack<16>>::bytes(blocks) +
           2 * std::size_t(memory.scratch().scene.pairs.room) * sizeof(driftwalk::BlockPair);
  };
  std::printf("%zu kB for 2000 blocks\n", of(2000) / 1000);
  CHECK(of(2000) < 2'000'000 && of(2000) < 5 * of(500));
}

} // namespace

int main() {
  check_against_all_pairs(25, Latching::collision, 6, 1500);
  check_against_all_pairs(70, Latching::connector, 4, 800);
  check_against_all_pairs(70, Latching::none, 4, 400);
  check_against_all_pairs(300, Latching::collision, 2, 500);
  check_growing_list();
  check_memory();
  return check::result();
}
