// Scenes put together by hand, and their conserved quantities summed block by block.
#pragma once

#include "driftwalk/assembly/settle_parts.hpp"
#include "squares.hpp"
#include "synthetic_assembly.hpp"

#include <utility>
#include <vector>

namespace synthetic {

struct Cell {
  int x, y;
};
using Cells = std::vector<Cell>;

// The tank and its rules, by default far larger than anything in it.
struct Place {
  Tank tank;
  driftwalk::PreparedRun<double> prepared;
  driftwalk::AssemblyRules rules;

  explicit Place(Tank given, int blocks) : tank(std::move(given)), prepared(still(tank)) {
    rules = rules_in(prepared, blocks);
  }
  static Tank wide() {
    Tank tank;
    tank.model.radius = 10;
    tank.nodes = 3;
    tank.spacing = 10;
    return tank;
  }

private:
  static const driftwalk::BatchModel& still(Tank& tank) {
    tank.set_flow([](double, double, double& u, double& v) { u = v = 0; });
    return tank.finished();
  }
};

struct HandScene {
  const driftwalk::AssemblyRules& rules;
  std::vector<driftwalk::SceneBlock> block, blocks_before;
  std::vector<driftwalk::SceneAssembly> assembly;
  std::vector<driftwalk::BlockPair> pairs, close;
  std::vector<driftwalk::PlacedBlock> by_cell;
  std::vector<std::int32_t> heads, next, event_step, event_block, event_face;
  driftwalk::Scene scene{};

  explicit HandScene(const driftwalk::AssemblyRules& given)
      : rules(given), block(std::size_t(given.blocks)), blocks_before(block.size()),
        assembly(block.size()), pairs(std::size_t(driftwalk::pair_capacity(given.blocks)) + 1),
        close(pairs.size()), by_cell(block.size()), heads(driftwalk::cell_heads),
        next(block.size()), event_step(block.size(), -1), event_block(2 * block.size(), -1),
        event_face(2 * block.size(), -1) {
    for (driftwalk::SceneBlock& b : block) {
      b.assembly = -1; // none yet
    }
    scene.blocks = given.blocks;
    scene.block = block.data();
    scene.blocks_before = blocks_before.data();
    scene.assembly = assembly.data();
    scene.pairs = {pairs.data(), 0, static_cast<int>(pairs.size()), nullptr, nullptr};
    scene.by_cell = by_cell.data();
    scene.close = {close.data(), 0, static_cast<int>(close.size()), nullptr, nullptr};
    scene.cell_head = heads.data();
    scene.cell_next = next.data();
    scene.step = 7;
    scene.event_rows = given.blocks;
    scene.event_step = event_step.data();
    scene.event_block = event_block.data();
    scene.event_face = event_face.data();
  }
  HandScene(const HandScene&) = delete;

  // Blocks given by index in cells; (x, y, theta) is the pose of the centre of mass.
  void add(const std::vector<int>& blocks, const Cells& cells, double x, double y, double theta,
           double vx = 0, double vy = 0, double omega = 0, int quarter = 0) {
    const int root = *std::min_element(blocks.begin(), blocks.end());
    for (std::size_t k = 0; k < blocks.size(); ++k) {
      driftwalk::SceneBlock& b = block[std::size_t(blocks[k])];
      b.assembly = root;
      b.cell_x = cells[k].x;
      b.cell_y = cells[k].y;
      b.quarter = quarter;
    }
    driftwalk::SceneAssembly& a = assembly[std::size_t(root)];
    a.x = x;
    a.y = y;
    a.theta = theta;
    a.cosine = std::cos(theta);
    a.sine = std::sin(theta);
    a.vx = vx;
    a.vy = vy;
    a.omega = omega;
    a.before = {a.x, a.y, a.theta, a.cosine, a.sine};
    driftwalk::measure_assembly(rules, scene, root);
    driftwalk::place_members(scene, root);
    ++scene.assemblies;
  }
  void settle() {
    driftwalk::find_pairs(rules, scene);
    driftwalk::settle(rules, scene);
  }
  const driftwalk::SceneAssembly& of(int b) const {
    return assembly[std::size_t(block[std::size_t(b)].assembly)];
  }
  squares::Square square(int b) const {
    const driftwalk::SceneBlock& at = block[std::size_t(b)];
    return {at.x, at.y, of(b).theta, rules.side};
  }
  double deepest() const {
    double depth = -1;
    for (int a = 0; a < scene.blocks; ++a) {
      for (int b = a + 1; b < scene.blocks; ++b) {
        if (block[std::size_t(a)].assembly != block[std::size_t(b)].assembly) {
          depth = std::max(depth, squares::overlap(square(a), square(b)));
        }
      }
    }
    return depth;
  }
};

struct Momentum {
  double x = 0, y = 0, spin = 0; // spin about the centre of mass of all blocks
  double energy = 0;
  double middle_x = 0, middle_y = 0;
};

// Of some blocks, each with its own velocity as a point of its assembly.
inline Momentum momentum(const HandScene& hand, const std::vector<int>& blocks) {
  Momentum sum;
  const double m = hand.rules.mass, count = double(blocks.size());
  for (const int b : blocks) {
    sum.middle_x += hand.square(b).x / count;
    sum.middle_y += hand.square(b).y / count;
  }
  for (const int b : blocks) {
    const squares::Square at = hand.square(b);
    const driftwalk::SceneAssembly& a = hand.of(b);
    const double vx = a.vx - a.omega * (at.y - a.y), vy = a.vy + a.omega * (at.x - a.x);
    sum.x += m * vx;
    sum.y += m * vy;
    sum.spin += m * ((at.x - sum.middle_x) * vy - (at.y - sum.middle_y) * vx) +
                hand.rules.inertia * a.omega;
    sum.energy += (m * (vx * vx + vy * vy) + hand.rules.inertia * a.omega * a.omega) / 2;
  }
  return sum;
}

} // namespace synthetic
