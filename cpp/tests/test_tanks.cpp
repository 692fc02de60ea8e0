// The batch of tanks: the bits of live worlds through any sequence of changes on each instruction
// set, worlds that do not depend on each other, copies, joined starts, and steps without an
// allocation.
#include "check.hpp"
#include "driftwalk/assembly/live.hpp"
#include "driftwalk/assembly/tank_batch.hpp"
#include "driftwalk/dispatch.hpp"
#include "environment.hpp"
#include "synthetic_assembly.hpp"

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <numeric>
#include <vector>

namespace {
std::atomic<std::size_t> allocations = 0;
}

// Every allocation of this program counts. Inlined they look like a mismatch to gcc.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* const memory = std::malloc(size)) {
    return memory;
  }
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}

namespace {

using driftwalk::AssemblyRules;
using driftwalk::Latching;
using driftwalk::LiveBlocks;
using driftwalk::LiveWorld;
using driftwalk::TankBatch;
using driftwalk::TankFlow;
using synthetic::Crowd;
using synthetic::Tank;

void swirl(double x, double y, double& u, double& v) {
  const double q = std::hypot(x, y) / 0.15;
  const double speed = 0.05 * q * (1.5 - q);
  u = -speed * y / 0.15 + 0.01 * std::sin(40 * y);
  v = speed * x / 0.15 + 0.01 * std::cos(40 * x);
}
void shear(double, double y, double& u, double& v) {
  u = 0.2 * y;
  v = 0;
}

// Two flows in one tank.
struct Basin {
  Tank tanks[2];
  std::unique_ptr<driftwalk::PreparedRun<float>> single[2];
  std::unique_ptr<driftwalk::PreparedRun<double>> twice[2];
  AssemblyRules rules[2];

  explicit Basin(int blocks, double bond_rate = 0) {
    for (int k = 0; k < 2; ++k) {
      Tank& tank = tanks[k];
      tank.let_float();
      tank.model.radius = 0.03 * std::sqrt(blocks + 3.0);
      tank.model.steps_per_interval = 3;
      tank.set_flow(k == 0 ? swirl : shear);
      single[k] = std::make_unique<driftwalk::PreparedRun<float>>(tank.finished());
      twice[k] = std::make_unique<driftwalk::PreparedRun<double>>(tank.finished());
      rules[k] = synthetic::rules_in(*twice[k], blocks);
      rules[k].bond_rate = bond_rate;
      rules[k].bonds_break = bond_rate > 0;
    }
  }
  std::vector<TankFlow> flows(bool in_doubles) const {
    std::vector<TankFlow> found(2);
    for (int k = 0; k < 2; ++k) {
      found[k].single = in_doubles ? nullptr : single[k].get();
      found[k].twice = in_doubles ? twice[k].get() : nullptr;
      found[k].rules = rules[k];
    }
    return found;
  }
};

// What every world has in a period; a world keeps its flow. Every sixth world has the flow, factor
// and latching of the first, so that they share a vector.
struct Settings {
  std::vector<std::int32_t> flow, latching;
  std::vector<double> flow_scale, drag, force;

  Settings(std::size_t worlds, synthetic::Uniform& any) {
    for (std::size_t w = 0; w < worlds; ++w) {
      flow.push_back(w % 2);
      latching.push_back(w < 6 ? std::int32_t(1.5 * (any() + 1)) % 3 : latching[w - 6]);
      flow_scale.push_back(w < 6 ? (any() < 0 ? 0.5 : 1.0) : flow_scale[w - 6]);
      drag.push_back(0.5 + 0.4 * any());
      force.push_back(2e-3 * (any() + 1));
    }
  }
  driftwalk::TankSettings of(std::size_t first) const {
    return {&flow[first], &latching[first], &flow_scale[first], &drag[first], &force[first]};
  }
};

Crowd crowd_in(const Basin& basin, int blocks, std::size_t worlds) {
  Crowd crowd(blocks);
  for (std::uint64_t k = 0; crowd.worlds() < worlds; ++k) {
    crowd.add_random(basin.rules[0], k, 0.45, 2e-3);
  }
  return crowd;
}

bool same(const TankBatch& a, const TankBatch& b) {
  return a.pose() == b.pose() && a.velocity() == b.velocity() && a.assembly() == b.assembly() &&
         a.cell() == b.cell() && a.quarter() == b.quarter() && a.last_event() == b.last_event();
}

void check_bits_of_live_worlds(int blocks, double bond_rate, std::size_t worlds) {
  const Basin basin(blocks, bond_rate);
  const Crowd crowd = crowd_in(basin, blocks, worlds);
  TankBatch batch(basin.flows(true), crowd.key, crowd.start.data(), nullptr, 2);
  const std::size_t row = std::size_t(blocks);
  std::vector<std::unique_ptr<LiveWorld>> live;
  for (std::size_t w = 0; w < worlds; ++w) {
    live.push_back(std::make_unique<LiveWorld>(*basin.twice[w % 2], basin.rules[w % 2],
                                               driftwalk::LiveForces{}, &crowd.start[3 * row * w],
                                               crowd.key[w]));
  }
  std::vector<double> pose(3 * row), velocity(3 * row);
  std::vector<std::int32_t> assembly(row), cell(2 * row), quarter(row), kind(row);
  std::vector<std::int32_t> last(worlds);
  synthetic::Uniform any;
  for (int period = 0; period < 30; ++period) {
    const Settings now(worlds, any);
    const std::int64_t steps = 30 + period % 5;
    batch.advance(now.of(0), steps, period % 3 + 1);
    for (std::size_t w = 0; w < worlds; ++w) {
      live[w]->set_forces({now.drag[w], now.force[w], now.flow_scale[w]});
      live[w]->set_rules(Latching(now.latching[w]), basin.rules[0].hidden_share, 0);
      while (live[w]->step() < batch.step()) {
        live[w]->advance(batch.step() - live[w]->step());
        const driftwalk::LiveEvents events = live[w]->events();
        for (int e = 0; e < events.count; ++e) {
          const bool counts = events.kind == nullptr || events.kind[e] < 2;
          last[w] = counts ? events.step[e] : last[w];
        }
      }
      live[w]->read({pose.data(), velocity.data(), assembly.data(), cell.data(), quarter.data(),
                     kind.data()});
      CHECK(std::memcmp(pose.data(), &batch.pose()[3 * row * w], 24 * row) == 0);
      CHECK(std::memcmp(velocity.data(), &batch.velocity()[3 * row * w], 24 * row) == 0);
      CHECK(std::memcmp(assembly.data(), &batch.assembly()[row * w], 4 * row) == 0);
      CHECK(std::memcmp(cell.data(), &batch.cell()[2 * row * w], 8 * row) == 0);
      CHECK(std::memcmp(quarter.data(), &batch.quarter()[row * w], 4 * row) == 0);
      CHECK(batch.last_event()[w] == last[w]);
      CHECK(batch.status()[w] == live[w]->status());
    }
  }
  CHECK(std::accumulate(last.begin(), last.end(), 0) > 0);
}

// In single precision: worlds together, each alone, and on three threads.
void check_worlds_apart(int blocks, std::size_t worlds) {
  const Basin basin(blocks);
  const Crowd crowd = crowd_in(basin, blocks, worlds);
  TankBatch whole(basin.flows(false), crowd.key, crowd.start.data(), nullptr, 1);
  TankBatch threaded(basin.flows(false), crowd.key, crowd.start.data(), nullptr, 3);
  std::vector<TankBatch> alone;
  for (std::size_t w = 0; w < worlds; ++w) {
    const Crowd one = crowd.alone(w);
    alone.emplace_back(basin.flows(false), one.key, one.start.data(), nullptr, 1);
  }
  synthetic::Uniform any;
  for (int period = 0; period < 12; ++period) {
    const Settings now(worlds, any);
    whole.advance(now.of(0), 50 + period % 4, 1);
    threaded.advance(now.of(0), 50 + period % 4, 3);
    CHECK(same(whole, threaded));
    for (std::size_t w = 0; w < worlds; ++w) {
      alone[w].advance(now.of(w), 50 + period % 4, 1);
      CHECK(same(alone[w], whole.take({std::int64_t(w)}, {crowd.key[w]})));
    }
  }
}

void check_copies(bool in_doubles) {
  constexpr std::size_t worlds = 6;
  const Basin basin(5);
  const Crowd crowd = crowd_in(basin, 5, worlds);
  TankBatch batch(basin.flows(in_doubles), crowd.key, crowd.start.data(), nullptr, 1);
  synthetic::Uniform any;
  const Settings now(worlds, any);
  batch.advance(now.of(0), 400, 1);
  TankBatch copy = batch.take({0, 1, 2, 3, 4, 5}, crowd.key);
  TankBatch other = batch.take({0, 1, 2, 3, 4, 5}, {1, 2, 3, 4, 5, 6});
  CHECK(same(batch, copy) && same(batch, other));
  for (TankBatch* one : {&batch, &copy, &other}) {
    one->advance(now.of(0), 100, 1);
  }
  CHECK(same(batch, copy));
  CHECK(!same(batch, other));
}

// A state read out and given as a start is the same state, but for rounding.
void check_joined_starts(bool in_doubles) {
  constexpr std::size_t worlds = 20;
  const Basin basin(6);
  const Crowd crowd = crowd_in(basin, 6, worlds);
  TankBatch batch(basin.flows(in_doubles), crowd.key, crowd.start.data(), nullptr, 1);
  synthetic::Uniform any;
  Settings now(worlds, any);
  now.latching.assign(worlds, 1);
  batch.advance(now.of(0), 2000, 1);
  std::vector<double> velocity = batch.velocity();
  std::vector<std::int32_t> assembly = batch.assembly(), cell = batch.cell(),
                            quarter = batch.quarter(), kind = batch.kind();
  const LiveBlocks joined{nullptr,     velocity.data(), assembly.data(),
                          cell.data(), quarter.data(),  kind.data()};
  const TankBatch again(basin.flows(in_doubles), crowd.key, batch.pose().data(), &joined, 1);
  CHECK(again.assembly() == batch.assembly() && again.cell() == batch.cell());
  CHECK(again.quarter() == batch.quarter());
  int in_assemblies = 0;
  for (std::size_t b = 0; b < assembly.size(); ++b) {
    in_assemblies += assembly[b] != std::int32_t(b % 6);
    const double tolerance = in_doubles ? 1e-12 : 1e-6;
    CHECK_NEAR(again.pose()[3 * b], batch.pose()[3 * b], tolerance);
    CHECK_NEAR(again.pose()[3 * b + 1], batch.pose()[3 * b + 1], tolerance);
    CHECK_NEAR(std::cos(again.pose()[3 * b + 2] - batch.pose()[3 * b + 2]), 1.0, tolerance);
    for (std::size_t k = 3 * b; k < 3 * b + 3; ++k) {
      CHECK_NEAR(again.velocity()[k], batch.velocity()[k], tolerance);
    }
  }
  CHECK(in_assemblies > 10);
}

void check_rest() {
  const Basin basin(3);
  const Crowd crowd = crowd_in(basin, 3, 4);
  TankBatch batch(basin.flows(false), crowd.key, crowd.start.data(), nullptr, 1);
  synthetic::Uniform any;
  Settings now(4, any);
  now.flow = {-1, 0, -1, 1};
  batch.advance(now.of(0), 200, 1);
  for (std::size_t w = 0; w < 4; ++w) {
    const bool moved = batch.pose()[9 * w] != crowd.start[9 * w];
    CHECK(moved == (w % 2 == 1) || std::abs(batch.pose()[9 * w] - crowd.start[9 * w]) < 1e-7);
  }
  now.flow.assign(4, -1);
  const TankBatch before = batch.take({0, 1, 2, 3}, crowd.key);
  batch.advance(now.of(0), 200, 2);
  CHECK(same(batch, before) && batch.step() == 400);
}

void check_allocations(bool in_doubles) {
  const Basin basin(6, 0.5);
  const Crowd crowd = crowd_in(basin, 6, 20);
  TankBatch batch(basin.flows(in_doubles), crowd.key, crowd.start.data(), nullptr, 1);
  synthetic::Uniform any;
  const Settings now(20, any);
  std::size_t found[2];
  for (int k = 0; k < 2; ++k) {
    const std::size_t before = allocations;
    batch.advance(now.of(0), k == 0 ? 1 : 2000, 1);
    found[k] = allocations - before;
  }
  CHECK(found[0] == found[1]);
}

} // namespace

int main() {
  using driftwalk::InstructionSet;
  for (const InstructionSet set :
       {InstructionSet::baseline, InstructionSet::avx2, InstructionSet::avx512}) {
    if (driftwalk::is_available(set)) {
      environment::choose_instruction_set(driftwalk::name(set));
      check_bits_of_live_worlds(5, 0, 60);
      check_bits_of_live_worlds(5, 0.5, 20);
      check_bits_of_live_worlds(30, 0, 3);
    }
  }
  environment::choose_instruction_set("");
  check_worlds_apart(4, 37);
  check_worlds_apart(26, 10); // each has the lanes for itself: more worlds are no other case
  for (const bool in_doubles : {false, true}) {
    check_copies(in_doubles);
    check_joined_starts(in_doubles);
    check_allocations(in_doubles);
  }
  check_rest();
  return check::result();
}
