// The live world: the same bits as whole runs however it is advanced, what is left when blocks are
// removed or parted, what is added, and that all stays a sound world through any sequence of
// changes, without an allocation.
#include "check.hpp"
#include "driftwalk/assembly/live.hpp"
#include "driftwalk/random/normal.hpp"
#include "driftwalk/random/philox.hpp"
#include "synthetic_assembly.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <map>
#include <new>
#include <vector>

namespace {
std::size_t allocations = 0;
}

// Every allocation of this program counts.
void* operator new(std::size_t size) {
  ++allocations;
  if (void* const memory = std::malloc(size)) {
    return memory;
  }
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}

namespace {

using driftwalk::AssemblyRules;
using driftwalk::Latching;
using driftwalk::LiveWorld;
using squares::pi;
using squares::Square;
using synthetic::Crowd;
using synthetic::CrowdResults;
using synthetic::Tank;

constexpr double side = 0.03;

void swirl(double x, double y, double& u, double& v) {
  const double q = std::hypot(x, y) / 0.15;
  const double speed = 0.05 * q * (1.5 - q);
  u = -speed * y / 0.15 + 0.01 * std::sin(40 * y);
  v = speed * x / 0.15 + 0.01 * std::cos(40 * x);
}
void still(double, double, double& u, double& v) {
  u = v = 0;
}

// The state of a live world; room for as many blocks as there may be.
struct Look {
  std::vector<double> pose, velocity;
  std::vector<std::int32_t> assembly, cell, quarter, kind;
  std::size_t blocks = 0;

  Look()
      : pose(3 * driftwalk::most_blocks), velocity(pose.size()), assembly(driftwalk::most_blocks),
        cell(2 * driftwalk::most_blocks), quarter(driftwalk::most_blocks),
        kind(driftwalk::most_blocks) {}
  explicit Look(const LiveWorld& world) : Look() { at(world); }

  void at(const LiveWorld& world) {
    blocks = std::size_t(world.blocks());
    world.read(
        {pose.data(), velocity.data(), assembly.data(), cell.data(), quarter.data(), kind.data()});
  }
  Square square(std::size_t b) const {
    return {pose[3 * b], pose[3 * b + 1], pose[3 * b + 2], side};
  }
};

// --- the same bits as a whole run ---

void check_same_as_whole_runs(Tank tank, int blocks, Latching latching) {
  tank.model.radius = 0.03 * std::sqrt(blocks + 3.0);
  tank.model.steps_per_interval = 3;
  tank.set_flow(swirl);
  const driftwalk::PreparedRun<double> prepared(tank.finished());
  AssemblyRules rules = synthetic::rules_in(prepared, blocks);
  rules.latching = latching;
  const std::int64_t steps = 1500;
  Crowd crowd(blocks);
  for (std::uint64_t k = 0; crowd.worlds() < 3; ++k) {
    crowd.add_random(rules, k, 0.45, 2e-3);
  }
  const CrowdResults whole = synthetic::assemble<double>(tank, rules, crowd, steps, 50);
  int joined = 0;
  for (std::size_t w = 0; w < crowd.worlds(); ++w) {
    const Crowd one = crowd.alone(w);
    LiveWorld live(prepared, rules, {0.45, 2e-3, 1.0}, one.start.data(), one.key[0]);
    Look look;
    int events = 0;
    for (std::int64_t chunk = 1; live.step() < steps; chunk = chunk % 7 + 1) {
      live.advance(std::min(chunk, steps - live.step()));
      for (int e = 0; e < live.events().count; ++e, ++events) {
        const std::size_t row = w * whole.events + std::size_t(events);
        CHECK(live.events().step[e] == whole.event_step[row]);
        CHECK(std::memcmp(live.events().block + 2 * e, &whole.event_block[2 * row], 8) == 0);
        CHECK(std::memcmp(live.events().face + 2 * e, &whole.event_face[2 * row], 8) == 0);
      }
      if (live.step() % 50 == 0) {
        look.at(live);
        const std::size_t row =
            (w * whole.samples + std::size_t(live.step()) / 50) * std::size_t(blocks);
        for (std::size_t k = 0; k < 3 * std::size_t(blocks); ++k) {
          CHECK(float(look.pose[k]) == whole.sample_pose[3 * row + k]);
        }
      }
    }
    look.at(live);
    const std::size_t k = std::size_t(blocks);
    CHECK(events == whole.event_count[w]);
    CHECK(std::memcmp(look.pose.data(), &whole.pose[w * 3 * k], 3 * k * sizeof(double)) == 0);
    CHECK(std::memcmp(look.cell.data(), &whole.cell[w * 2 * k], 2 * k * 4) == 0);
    CHECK(std::memcmp(look.quarter.data(), &whole.quarter[w * k], k * 4) == 0);
    CHECK(std::memcmp(look.assembly.data(), &whole.assembly[w * k], k * 4) == 0);
    CHECK(live.status() == 0);
    joined += events;
  }
  std::printf("%d blocks, latching %d: the same bits, %d joinings\n", blocks, int(latching),
              joined);
  CHECK(blocks == 1 || latching == Latching::none || joined > 0);
}

// --- removing and parting ---

// A world in which the blocks have joined into a few assemblies that move and turn.
struct Joined {
  Tank tank;
  driftwalk::PreparedRun<double> prepared;
  AssemblyRules rules;
  Crowd crowd;
  LiveWorld live;

  explicit Joined(int blocks, std::uint64_t number = 5)
      : tank(make_tank(blocks)), prepared(tank.finished()),
        rules(synthetic::rules_in(prepared, blocks)), crowd(make_crowd(number)),
        live(prepared, rules, {0.45, 2e-3, 1.0}, crowd.start.data(), crowd.key[0]) {
    live.advance(1500);
  }

private:
  static Tank make_tank(int blocks) {
    Tank tank;
    tank.model.radius = 0.03 * std::sqrt(blocks + 3.0);
    tank.set_flow(swirl);
    return tank;
  }
  Crowd make_crowd(std::uint64_t number) const {
    Crowd made(rules.blocks);
    while (!made.add_random(rules, number++, 0.45, 2e-3)) {
    }
    return made;
  }
};

// What is on one lattice is rigid and hangs together; returns the number of assemblies.
int check_assemblies(const Look& look) {
  std::map<int, std::vector<std::size_t>> members;
  for (std::size_t b = 0; b < look.blocks; ++b) {
    members[look.assembly[b]].push_back(b);
  }
  for (const auto& [root, all] : members) {
    CHECK(std::size_t(root) == all.front());
    std::vector<std::size_t> reached{all.front()};
    for (std::size_t k = 0; k < reached.size(); ++k) {
      for (const std::size_t b : all) {
        const std::size_t a = reached[k];
        const int dx = look.cell[2 * b] - look.cell[2 * a];
        const int dy = look.cell[2 * b + 1] - look.cell[2 * a + 1];
        if (std::abs(dx) + std::abs(dy) == 1 &&
            std::find(reached.begin(), reached.end(), b) == reached.end()) {
          reached.push_back(b);
        }
        const double frame = look.pose[3 * a + 2] - look.quarter[a] * pi / 2;
        const double x = look.pose[3 * a] + side * (dx * std::cos(frame) - dy * std::sin(frame));
        const double y =
            look.pose[3 * a + 1] + side * (dx * std::sin(frame) + dy * std::cos(frame));
        CHECK_NEAR(look.pose[3 * b], x, 1e-12);
        CHECK_NEAR(look.pose[3 * b + 1], y, 1e-12);
        const double turned = look.pose[3 * b + 2] - (frame + look.quarter[b] * pi / 2);
        CHECK_NEAR(std::remainder(turned, 2 * pi), 0, 1e-12);
        // The velocities are those of one rigid body.
        CHECK(look.velocity[3 * b + 2] == look.velocity[3 * a + 2]);
        const double spin = look.velocity[3 * a + 2];
        CHECK_NEAR(look.velocity[3 * b],
                   look.velocity[3 * a] - spin * (look.pose[3 * b + 1] - look.pose[3 * a + 1]),
                   1e-12);
      }
    }
    CHECK(reached.size() == all.size());
  }
  return int(members.size());
}

// Blocks go on as they were moving, at the same places; those whose assembly has lost nothing keep
// every bit.
void check_kept(const Look& before, const Look& after) {
  for (std::size_t b = 0; b < after.blocks; ++b) {
    const auto members = [&](const Look& look) {
      return std::count(look.assembly.begin(), look.assembly.begin() + std::ptrdiff_t(look.blocks),
                        look.assembly[b]);
    };
    const bool whole = members(before) == members(after);
    for (std::size_t k = 3 * b; k < 3 * b + 3; ++k) {
      CHECK(whole ? after.pose[k] == before.pose[k]
                  : std::fabs(after.pose[k] - before.pose[k]) < 1e-14);
      CHECK(whole ? after.velocity[k] == before.velocity[k]
                  : std::fabs(after.velocity[k] - before.velocity[k]) < 1e-14);
    }
    CHECK(after.pose[3 * b + 2] == before.pose[3 * b + 2]);
  }
}

void check_removal() {
  int fell_apart = 0;
  for (const int blocks : {3, 9, 20, 40}) {
    for (std::uint64_t number = 1; number <= 5; ++number) {
      Joined world(blocks, 100 * number);
      Look before(world.live);
      for (int left = blocks - 1; left >= 1; left -= 1 + left / 3) {
        const int assemblies = check_assemblies(before);
        CHECK(world.live.set_blocks(left) == left);
        const Look after(world.live);
        CHECK(int(after.blocks) == left);
        check_kept(before, after);
        fell_apart += check_assemblies(after) > assemblies;
        world.live.advance(3);
        before.at(world.live);
        CHECK(world.live.status() == 0);
      }
    }
  }
  std::printf("removal: more assemblies than before in %d cases\n", fell_apart);
  CHECK(fell_apart > 0);
}

void check_parting() {
  for (const int blocks : {1, 4, 30}) {
    Joined world(blocks);
    const Look before(world.live);
    const int assemblies = check_assemblies(before);
    CHECK(blocks == 1 || assemblies < blocks);
    world.live.set_rules(Latching::none, 0, 0);
    world.live.part();
    const Look after(world.live);
    check_kept(before, after);
    CHECK(check_assemblies(after) == blocks);
    world.live.advance(500);
    const Look later(world.live);
    CHECK(check_assemblies(later) == blocks);
    // Where blocks may latch, those that lie face to face do at once.
    Joined again(blocks);
    again.live.part();
    CHECK(check_assemblies(Look(again.live)) == blocks);
    again.live.advance(1);
    CHECK(check_assemblies(Look(again.live)) == assemblies);
  }
}

// --- adding ---

// What a block that comes later does: it rests at a free place, and its force has the address that
// it would have had anyway. The blocks that are there notice nothing.
void check_adding(std::int64_t at_step) {
  Tank tank;
  tank.model.radius = 0.3;
  tank.model.steps_per_interval = 5;
  tank.set_flow(still);
  const driftwalk::PreparedRun<double> prepared(tank.finished());
  const AssemblyRules rules = synthetic::rules_in(prepared, 2);
  const double start[] = {-0.2, 0, 0.3, 0.2, 0, 1.0};
  const std::uint64_t key = 0x123456789abcdefull;
  const driftwalk::LiveForces forces{0.0, 1e-3, 1.0};
  LiveWorld live(prepared, rules, forces, start, key), alone(prepared, rules, forces, start, key);
  live.advance(at_step);
  alone.advance(at_step);
  CHECK(live.set_blocks(4) == 4);
  const Look placed(live);
  for (std::size_t a = 0; a < 4; ++a) {
    CHECK(squares::outside(tank, placed.square(a)) < 0);
    for (std::size_t b = a + 1; b < 4; ++b) {
      CHECK(squares::overlap(placed.square(a), placed.square(b)) < 0);
    }
  }
  live.advance(2);
  alone.advance(2);
  const Look after(live), other(alone);
  const double dt = tank.model.time_step;
  const driftwalk::Philox<std::uint32_t> stream{std::uint32_t(key), std::uint32_t(key >> 32)};
  for (std::uint32_t b = 2; b < 4; ++b) {
    CHECK(placed.velocity[3 * b] == 0 && placed.velocity[3 * b + 1] == 0);
    const std::uint32_t interval = std::uint32_t(at_step / 5);
    std::uint32_t words[4];
    stream(interval / 2, b, 0, 1, words);
    double x, y;
    const std::uint32_t half = 2 * (interval % 2);
    driftwalk::normal_pair(words[half], words[half + 1], x, y);
    CHECK_NEAR(after.velocity[3 * b], 2 * dt * x * 1e-3 / tank.model.mass, 1e-15);
    CHECK_NEAR(after.velocity[3 * b + 1], 2 * dt * y * 1e-3 / tank.model.mass, 1e-15);
  }
  CHECK(std::memcmp(after.pose.data(), other.pose.data(), 6 * sizeof(double)) == 0);
}

void check_full_tank() {
  Tank tank;
  tank.model.radius = 0.05;
  tank.set_flow(still);
  const driftwalk::PreparedRun<double> prepared(tank.finished());
  AssemblyRules rules = synthetic::rules_in(prepared, 1);
  const double start[] = {0, 0, 0};
  LiveWorld live(prepared, rules, {0.45, 1e-3, 1.0}, start, 1);
  const int found = live.set_blocks(9);
  CHECK(found >= 1 && found < 9);
  live.advance(10);
  CHECK(live.blocks() == found && live.status() == 0);
}

// --- changes while it runs ---

// Everything rests until the forces come: then it is a run from the start, whatever was before.
void check_late_forces() {
  for (const int blocks : {4, 30}) {
    Tank tank;
    tank.model.radius = 0.03 * std::sqrt(blocks + 3.0);
    tank.set_flow(swirl);
    const driftwalk::PreparedRun<double> prepared(tank.finished());
    const AssemblyRules rules = synthetic::rules_in(prepared, blocks);
    AssemblyRules hard = rules;
    hard.latching = Latching::none;
    hard.hidden_share = 1;
    Crowd crowd(blocks);
    while (!crowd.add_random(rules, crowd.worlds() + 3, 0.45, 0)) {
    }
    LiveWorld late(prepared, hard, {2.0, 0.0, 0.0}, crowd.start.data(), crowd.key[0]);
    LiveWorld fresh(prepared, rules, {0.45, 0.0, 1.5}, crowd.start.data(), crowd.key[0]);
    late.advance(120);
    CHECK(Look(late).pose == Look(fresh).pose);
    late.set_forces({0.45, 0.0, 1.5});
    late.set_rules(rules.latching, rules.hidden_share, rules.stirring_length);
    int joined = 0;
    for (int k = 0; k < 40; ++k) {
      late.advance(50);
      fresh.advance(50);
      joined += late.events().count;
      CHECK(late.events().count == fresh.events().count);
      CHECK(Look(late).pose == Look(fresh).pose);
      CHECK(Look(late).assembly == Look(fresh).assembly);
    }
    CHECK(joined > 0);
  }
}

// Drag on hidden faces changes for what is joined already.
void check_hidden_faces() {
  Joined world(9), other(9);
  CHECK(check_assemblies(Look(world.live)) < 9);
  world.live.set_rules(world.rules.latching, 1, 0);
  world.live.advance(5);
  other.live.advance(5);
  CHECK(Look(world.live).pose != Look(other.live).pose);
  Joined back(9);
  back.live.set_rules(world.rules.latching, 1, 0);
  back.live.set_rules(world.rules.latching, 0, 0);
  back.live.advance(5);
  CHECK(Look(back.live).pose == Look(other.live).pose);
}

void check_any_sequence() {
  Tank tank;
  tank.model.radius = 0.21;
  tank.model.steps_per_interval = 2;
  tank.set_flow(swirl);
  const driftwalk::PreparedRun<double> prepared(tank.finished());
  const AssemblyRules rules = synthetic::rules_in(prepared, 6);
  Crowd crowd(6);
  while (!crowd.add_random(rules, crowd.worlds() + 1, 0.45, 0)) {
  }
  LiveWorld live(prepared, rules, {0.45, 1e-3, 1.0}, crowd.start.data(), crowd.key[0]);
  synthetic::Uniform random;
  Look look;
  const auto below = [&](int count) { return int((random() + 1) / 2 * count) % count; };
  double overlap = -1, outside = -1;
  int most = 0;
  const std::size_t before = allocations;
  std::size_t own = 0;
  for (int round = 0; round < 400; ++round) {
    switch (below(5)) {
    case 0:
      live.set_blocks(1 + below(50));
      break;
    case 1:
      live.part();
      break;
    case 2:
      live.set_rules(Latching(below(3)), 0.5 * below(3), below(2) * 0.05);
      break;
    case 3:
      live.set_forces({random() + 1, 4e-3 * (random() + 1), random() + 1});
      break;
    default:
      live.set_blocks(std::max(live.blocks() - 1, 1));
    }
    live.advance(2 * below(20));
    const std::size_t while_checking = allocations;
    look.at(live);
    check_assemblies(look);
    CHECK(live.status() == 0);
    most = std::max(most, live.blocks());
    for (std::size_t a = 0; a < look.blocks; ++a) {
      outside = std::max(outside, squares::outside(tank, look.square(a)));
      for (std::size_t b = a + 1; b < look.blocks; ++b) {
        overlap = std::max(overlap, squares::overlap(look.square(a), look.square(b)));
      }
    }
    own += allocations - while_checking;
  }
  std::printf("any sequence: up to %d blocks, overlap %.2g m, outside %.2g m\n", most, overlap,
              outside);
  CHECK(allocations - before == own);
  CHECK(most > 24); // lists of near pairs and all pairs
  CHECK(overlap < 1.001e-4);
  CHECK(outside < 1.001e-4);
}

} // namespace

int main() {
  for (const Latching latching : {Latching::none, Latching::collision, Latching::connector}) {
    for (const int blocks : {1, 4, 30}) {
      check_same_as_whole_runs(Tank(), blocks, latching);
    }
    Tank floating;
    floating.let_float();
    check_same_as_whole_runs(floating, 4, latching);
  }
  check_removal();
  check_parting();
  check_adding(0);
  check_adding(35);
  check_adding(40);
  check_full_tank();
  check_late_forces();
  check_hidden_faces();
  check_any_sequence();
  return check::result();
}
