// Synthetic worlds with several blocks for the tests.
#pragma once

#include "driftwalk/assembly/assemble.hpp"
#include "squares.hpp"
#include "synthetic_tank.hpp"

#include <cstdint>
#include <vector>

namespace synthetic {

// Rules of a prepared tank; it has to outlive them.
inline driftwalk::AssemblyRules rules_in(const driftwalk::PreparedRun<double>& prepared,
                                         int blocks) {
  const driftwalk::Prepared<double>& run = prepared.view();
  driftwalk::AssemblyRules rules;
  rules.blocks = blocks;
  rules.side = 2 * run.block.half_side;
  rules.mass = run.mass;
  rules.inertia = run.inertia;
  rules.radius = run.wall.radius;
  rules.edges = run.wall.edges;
  rules.edge_count = run.wall.edge_count;
  rules.low_x = run.flow.low_x;
  rules.high_x = run.flow.high_x;
  rules.low_y = run.flow.low_y;
  rules.high_y = run.flow.high_y;
  rules.bounce_speed = run.wall.bounce_speed;
  rules.restitution = 0.5;
  rules.latching = driftwalk::Latching::connector;
  rules.connector_distance = 0.01;
  rules.connector_cosine = std::cos(0.2);
  return rules;
}

// Inputs of worlds with the same number of blocks.
struct Crowd {
  int blocks;
  std::vector<double> start, drag_coefficient, force_std;
  std::vector<std::uint64_t> key;

  explicit Crowd(int count) : blocks(count) {}

  // A world of randomly placed blocks, when they fit.
  bool add_random(const driftwalk::AssemblyRules& rules, std::uint64_t number, double drag,
                  double force) {
    std::vector<double> poses(3 * static_cast<std::size_t>(blocks));
    const std::uint64_t own_key = 0x9E3779B97F4A7C15ull * (number + 1);
    if (driftwalk::place_blocks(rules, own_key, poses.data()) != blocks) {
      return false;
    }
    add(poses, own_key, drag, force);
    return true;
  }
  void add(const std::vector<double>& poses, std::uint64_t own_key, double drag, double force) {
    start.insert(start.end(), poses.begin(), poses.end());
    key.push_back(own_key);
    drag_coefficient.push_back(drag);
    force_std.push_back(force);
  }
  std::size_t worlds() const { return key.size(); }
  // Only one of the worlds.
  Crowd alone(std::size_t world) const {
    Crowd one(blocks);
    const std::size_t row = 3 * static_cast<std::size_t>(blocks);
    const auto first = start.begin() + static_cast<std::ptrdiff_t>(row * world);
    one.add({first, first + static_cast<std::ptrdiff_t>(row)}, key[world], drag_coefficient[world],
            force_std[world]);
    return one;
  }
};

struct CrowdResults {
  std::vector<std::uint32_t> status;
  std::vector<std::int32_t> event_count, event_step, event_block, event_face, first_contact,
      end_step, cell, quarter, assembly, sample_assembly;
  std::vector<double> pose;
  std::vector<float> sample_pose;
  std::size_t blocks = 0, events = 0, samples = 0;
  std::int64_t block_steps = 0;

  squares::Square sampled(std::size_t world, std::size_t sample, std::size_t block,
                          double side) const {
    const float* const at = &sample_pose[3 * ((world * samples + sample) * blocks + block)];
    return {at[0], at[1], at[2], side};
  }
};

template <class T>
CrowdResults assemble(Tank& tank, const driftwalk::AssemblyRules& rules, const Crowd& crowd,
                      std::int64_t steps, int sample_every = 0, int threads = 1) {
  const driftwalk::PreparedRun<T> run(tank.finished());
  const std::size_t worlds = crowd.worlds(), blocks = static_cast<std::size_t>(crowd.blocks);
  CrowdResults found;
  found.blocks = blocks;
  found.events = std::max<std::size_t>(blocks - 1, 1);
  found.samples = sample_every > 0 ? static_cast<std::size_t>(steps / sample_every + 1) : 0;
  found.status.resize(worlds);
  found.event_count.resize(worlds);
  found.event_step.assign(worlds * found.events, -1);
  found.event_block.assign(worlds * found.events * 2, -1);
  found.event_face.assign(worlds * found.events * 2, -1);
  found.first_contact.resize(worlds);
  found.end_step.resize(worlds);
  found.cell.resize(worlds * blocks * 2);
  found.quarter.resize(worlds * blocks);
  found.assembly.resize(worlds * blocks);
  found.pose.resize(worlds * blocks * 3);
  found.sample_pose.resize(worlds * found.samples * blocks * 3);
  found.sample_assembly.resize(worlds * found.samples * blocks);
  driftwalk::AssemblyWorlds input;
  input.count = static_cast<std::int64_t>(worlds);
  input.steps = steps;
  input.start = crowd.start.data();
  input.drag_coefficient = crowd.drag_coefficient.data();
  input.force_std = crowd.force_std.data();
  input.key = crowd.key.data();
  driftwalk::AssemblyOutputs out;
  out.status = found.status.data();
  out.event_count = found.event_count.data();
  out.event_step = found.event_step.data();
  out.event_block = found.event_block.data();
  out.event_face = found.event_face.data();
  out.first_contact_step = found.first_contact.data();
  out.end_step = found.end_step.data();
  out.pose = found.pose.data();
  out.cell = found.cell.data();
  out.quarter = found.quarter.data();
  out.assembly = found.assembly.data();
  out.event_rows = static_cast<int>(found.events);
  out.sample_every = sample_every;
  out.samples = static_cast<std::int64_t>(found.samples);
  out.sample_pose = found.sample_pose.data();
  out.sample_assembly = found.sample_assembly.data();
  found.block_steps = driftwalk::assemble_batch(run, rules, input, threads, out);
  return found;
}

} // namespace synthetic
