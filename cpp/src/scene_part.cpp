// Assemblies that lose blocks, come apart into them, or are made of them at the start.
#include "driftwalk/assembly/settle_parts.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace driftwalk {

void cut_loose(const AssemblyRules& rules, Scene& scene, const SceneAssembly& from, int lowest) {
  const Vec2 at = centre(scene, lowest);
  SceneAssembly& body = scene.assembly[lowest];
  body = from;
  measure_assembly(rules, scene, lowest);
  place_by(scene, lowest, lowest, at);
  body.vx = from.vx - from.omega * (body.y - from.y);
  body.vy = from.vy + from.omega * (body.x - from.x);
  body.before = {body.x, body.y, body.theta, body.cosine, body.sine};
  body.touched = true;
}

bool are_neighbours(const AssemblyRules& rules, const Scene& scene, int first, int second) {
  const SceneBlock &a = scene.block[first], &b = scene.block[second];
  if (!on_lattice(rules)) {
    const double side = std::max(rules.side, rules.width);
    return overlap_of(rules, scene, first, second).depth >= -contact_gap * side;
  }
  return std::abs(a.cell_x - b.cell_x) + std::abs(a.cell_y - b.cell_y) == 1;
}

namespace {
// Labels members of an assembly, from one to before another, with the lowest of them that each
// hangs together with.
void label_connected(const AssemblyRules& rules, Scene& scene, int first, int end) {
  for (int b = first; b != end; b = scene.block[b].next) {
    scene.block[b].assembly = b;
  }
  for (bool changed = true; changed;) {
    changed = false;
    for (int b = first; b != end; b = scene.block[b].next) {
      for (int c = scene.block[b].next; c != end; c = scene.block[c].next) {
        SceneBlock &one = scene.block[b], &other = scene.block[c];
        if (one.assembly != other.assembly && are_neighbours(rules, scene, b, c)) {
          one.assembly = other.assembly = std::min(one.assembly, other.assembly);
          changed = true;
        }
      }
    }
  }
}

// The frame of an assembly, turned by quarter turns.
SceneAssembly turned(SceneAssembly a, int quarters) {
  constexpr double pi = 3.141592653589793;
  const Vec2 axis = face_normal(a, quarters);
  a.cosine = axis.x;
  a.sine = axis.y;
  a.theta += quarters * (pi / 2);
  a.theta -= a.theta > pi ? 2 * pi : 0.0;
  return a;
}
} // namespace

void keep_first_blocks(const AssemblyRules& rules, Scene& scene, int blocks) {
  scene.blocks = blocks;
  scene.assemblies = 0;
  // Members stand in the order of their indices. What an assembly falls into comes later in the
  // loop, and is whole then.
  for (int a = 0; a < blocks; ++a) {
    const SceneAssembly from = scene.assembly[a];
    if (from.blocks > 0 && from.last >= blocks) {
      int end = from.first;
      while (end >= 0 && end < blocks) {
        end = scene.block[end].next;
      }
      label_connected(rules, scene, from.first, end);
      std::copy_n(scene.block, blocks, scene.blocks_before);
      for (int b = from.first; b != end; b = scene.blocks_before[b].next) {
        if (scene.block[b].assembly == b) {
          cut_loose(rules, scene, from, b);
        }
      }
    }
    scene.assemblies += from.blocks > 0;
  }
}

void glue_blocks(const AssemblyRules& rules, Scene& scene) {
  for (int first = 0; first < scene.blocks; first += rules.glued) {
    const Vec2 at = centre(scene, first);
    for (int k = 0; k < rules.glued; ++k) {
      SceneBlock& block = scene.block[first + k];
      block.assembly = first;
      block.cell_x = rules.glued_cells[2 * k];
      block.cell_y = rules.glued_cells[2 * k + 1];
      scene.assembly[first + k].blocks = 0;
    }
    measure_assembly(rules, scene, first);
    place_by(scene, first, first, at);
    scene.assembly[first].touched = true;
  }
  scene.assemblies = scene.blocks / rules.glued;
}

void join_blocks(const AssemblyRules& rules, Scene& scene, const LiveBlocks& joined) {
  constexpr double full_turn = 2 * 3.141592653589793;
  scene.assemblies = 0;
  for (int b = 0; b < scene.blocks; ++b) {
    SceneBlock& block = scene.block[b];
    const int lowest = block.assembly = joined.assembly[b];
    block.cell_x = joined.cell[2 * b];
    block.cell_y = joined.cell[2 * b + 1];
    block.quarter = joined.quarter[b];
    block.kind = static_cast<std::uint8_t>(joined.kind[b]);
    if (!on_lattice(rules)) {
      const SceneAssembly &own = scene.assembly[b], &body = scene.assembly[lowest];
      const double turn = own.theta - body.theta;
      block.turn = turn - full_turn * std::floor(turn / full_turn);
      block.turn_cosine = own.cosine * body.cosine + own.sine * body.sine;
      block.turn_sine = own.sine * body.cosine - own.cosine * body.sine;
    }
    if (lowest != b) {
      scene.assembly[b].blocks = 0;
    }
    scene.assemblies += lowest == b;
  }
  for (int b = 0; b < scene.blocks; ++b) {
    if (scene.block[b].assembly == b) {
      const Vec2 at = centre(scene, b);
      SceneAssembly& body = scene.assembly[b];
      body = turned(body, (4 - scene.block[b].quarter) & 3);
      measure_assembly(rules, scene, b);
      place_by(scene, b, b, at);
      const double* const v = joined.velocity + 3 * b;
      body.vx = v[0] + v[2] * (at.y - body.y);
      body.vy = v[1] - v[2] * (at.x - body.x);
      body.omega = v[2];
      body.before = {body.x, body.y, body.theta, body.cosine, body.sine};
      body.touched = true;
    }
  }
}

void part_blocks(const AssemblyRules& rules, Scene& scene) {
  std::copy_n(scene.block, scene.blocks, scene.blocks_before);
  for (int b = 0; b < scene.blocks; ++b) {
    SceneBlock& block = scene.block[b];
    block.assembly = b;
    block.cell_x = block.cell_y = block.quarter = 0;
    block.kind = first_kind(rules.faces, b);
  }
  for (int a = 0; a < scene.blocks; ++a) {
    const SceneAssembly from = scene.assembly[a];
    // What has been cut loose is an assembly of one.
    for (int b = from.first; from.blocks > 1 && b >= 0; b = scene.blocks_before[b].next) {
      cut_loose(rules, scene, turned(from, scene.blocks_before[b].quarter), b);
    }
  }
  scene.assemblies = scene.blocks;
}

} // namespace driftwalk
