// Geometry of a scene: overlaps of squares and rectangles, members of assemblies, the wall.
#include "driftwalk/assembly/settle_parts.hpp"

#include <algorithm>
#include <cmath>

namespace driftwalk {

Overlap overlap_of(const AssemblyRules& rules, const Scene& scene, int first, int second) {
  const Vec2 between = centre(scene, second) - centre(scene, first);
  if (rules.round) {
    const double apart = std::sqrt(dot(between, between));
    return {rules.side - apart, between * (1 / std::max(apart, 1e-9)), true};
  }
  const Vec2 a = axis_of(rules, scene, first), b = axis_of(rules, scene, second);
  const Vec2 axes[4] = {a, {-a.y, a.x}, b, {-b.y, b.x}};
  double reach[2];
  find_reach(rules, a, b, reach);
  Overlap least{HUGE_VAL, {0, 0}, true};
  for (int k = 0; k < 4; ++k) {
    const double along = dot(between, axes[k]);
    const double depth = reach[k & 1] - std::abs(along);
    if (depth < least.depth) {
      least = {depth, axes[k] * (along < 0 ? -1.0 : 1.0), k < 2};
    }
  }
  return least;
}

void place_members(Scene& scene, int assembly) {
  const SceneAssembly& a = scene.assembly[assembly];
  for (int b = a.first; b >= 0; b = scene.block[b].next) {
    SceneBlock& block = scene.block[b];
    block.x = a.x + (a.cosine * block.offset_x - a.sine * block.offset_y);
    block.y = a.y + (a.sine * block.offset_x + a.cosine * block.offset_y);
  }
}

void place_by(Scene& scene, int assembly, int block, Vec2 at) {
  SceneAssembly& a = scene.assembly[assembly];
  const SceneBlock& b = scene.block[block];
  a.x = at.x - (a.cosine * b.offset_x - a.sine * b.offset_y);
  a.y = at.y - (a.sine * b.offset_x + a.cosine * b.offset_y);
  place_members(scene, assembly);
}

namespace {
void link_members(Scene& scene, int assembly) {
  SceneAssembly& a = scene.assembly[assembly];
  a.blocks = 0;
  a.first = a.last = -1;
  for (int b = 0; b < scene.blocks; ++b) {
    if (scene.block[b].assembly == assembly) {
      add_member(scene, a, b);
    }
  }
}

// Of what latches as it lies, from where it is.
void measure_places(const AssemblyRules& rules, Scene& scene, SceneAssembly& a) {
  Vec2 sum{0, 0};
  for (int b = a.first; b >= 0; b = scene.block[b].next) {
    sum = sum + centre(scene, b);
  }
  a.x = sum.x / a.blocks;
  a.y = sum.y / a.blocks;
  a.inertia = 0;
  for (int b = a.first; b >= 0; b = scene.block[b].next) {
    const Vec2 arm = centre(scene, b) - Vec2{a.x, a.y};
    scene.block[b].offset_x = dot(face_normal(a, 0), arm);
    scene.block[b].offset_y = dot(face_normal(a, 1), arm);
    a.inertia += rules.inertia + rules.mass * dot(arm, arm);
  }
}
} // namespace

void measure_assembly(const AssemblyRules& rules, Scene& scene, int assembly) {
  link_members(scene, assembly);
  measure_members(rules, scene, assembly);
  join_faces(rules, scene, assembly);
}

void measure_members(const AssemblyRules& rules, Scene& scene, int assembly) {
  SceneAssembly& a = scene.assembly[assembly];
  if (!on_lattice(rules)) {
    measure_places(rules, scene, a);
    return;
  }
  int sum_x = 0, sum_y = 0;
  for (int b = a.first; b >= 0; b = scene.block[b].next) {
    sum_x += scene.block[b].cell_x;
    sum_y += scene.block[b].cell_y;
  }
  a.inertia = 0;
  for (int b = a.first; b >= 0; b = scene.block[b].next) {
    SceneBlock& block = scene.block[b];
    block.offset_x = rules.side * (static_cast<double>(block.cell_x * a.blocks - sum_x) / a.blocks);
    block.offset_y = rules.side * (static_cast<double>(block.cell_y * a.blocks - sum_y) / a.blocks);
    a.inertia += rules.inertia +
                 rules.mass * (block.offset_x * block.offset_x + block.offset_y * block.offset_y);
  }
}

void join_faces(const AssemblyRules& rules, Scene& scene, int assembly) {
  if (!on_lattice(rules)) {
    return;
  }
  // Cells in front of faces 0 .. 3.
  constexpr int step_x[4] = {1, 0, -1, 0}, step_y[4] = {0, 1, 0, -1};
  const SceneAssembly& a = scene.assembly[assembly];
  LatticeTable cells(scene);
  for (int b = a.first; b >= 0; b = scene.block[b].next) {
    const SceneBlock& block = scene.block[b];
    cells.clear(block.cell_x, block.cell_y);
    for (int face = 0; face < 4; ++face) {
      cells.clear(block.cell_x + step_x[face], block.cell_y + step_y[face]);
    }
  }
  for (int b = a.first; b >= 0; b = scene.block[b].next) {
    cells.add(b);
  }
  for (int b = a.first; b >= 0; b = scene.block[b].next) {
    SceneBlock& block = scene.block[b];
    block.joined = 0;
    for (int face = 0; face < 4; ++face) {
      const bool neighbour = cells.has(block.cell_x + step_x[face], block.cell_y + step_y[face]);
      block.joined |= neighbour ? 1u << face : 0u;
    }
  }
}

namespace {
void extend(Beyond& most, double depth, Vec2 inward) {
  if (depth > most.depth) {
    most = {depth, inward};
  }
}

// How far a corner, or a disc about it, is beyond the wall.
void measure_corner(const AssemblyRules& rules, Vec2 corner, double radius, Beyond& most) {
  if (rules.radius > 0) {
    const double distance = std::sqrt(dot(corner, corner));
    extend(most, distance - rules.radius + radius, corner * (-1.0 / std::max(distance, 1e-9)));
    return;
  }
  for (int e = 0; e < rules.edge_count; ++e) {
    const PreparedEdge<double>& edge = rules.edges[e];
    extend(most, corner.x * edge.normal_x + corner.y * edge.normal_y - edge.distance + radius,
           {-edge.normal_x, -edge.normal_y});
  }
}

// Whether a block there is within a circular wall whatever its angle; of a polygon it says no.
bool is_clear_of_wall(const AssemblyRules& rules, Vec2 middle) {
  const double inner = rules.radius - std::sqrt(square_of_diagonal(rules)) / 2;
  return inner > 0 && dot(middle, middle) < inner * inner;
}
} // namespace

Beyond beyond_wall(const AssemblyRules& rules, const Scene& scene, int assembly) {
  Beyond most{-HUGE_VAL, {0, 0}};
  const SceneAssembly& a = scene.assembly[assembly];
  for (int b = a.first; b >= 0; b = scene.block[b].next) {
    const Vec2 middle = centre(scene, b);
    if (is_clear_of_wall(rules, middle)) {
      continue;
    }
    if (rules.round) {
      measure_corner(rules, middle, rules.side / 2, most);
      continue;
    }
    const Vec2 axis = axis_of(rules, scene, b);
    const Vec2 along = axis * (rules.side / 2);
    const Vec2 across = Vec2{-axis.y, axis.x} * (width_of(rules) / 2);
    for (const Vec2& corner : {along + across, along - across, across - along,
                               Vec2{-along.x - across.x, -along.y - across.y}}) {
      measure_corner(rules, middle + corner, 0, most);
    }
  }
  return most;
}

bool push_inside(const AssemblyRules& rules, Scene& scene, int assembly, int rounds) {
  constexpr double tolerance = 1e-6;
  for (int round = 0; round < rounds; ++round) {
    const Beyond beyond = beyond_wall(rules, scene, assembly);
    if (!(beyond.depth > tolerance)) {
      return true;
    }
    SceneAssembly& a = scene.assembly[assembly];
    a.x += beyond.inward.x * beyond.depth;
    a.y += beyond.inward.y * beyond.depth;
    place_members(scene, assembly);
  }
  return !(beyond_wall(rules, scene, assembly).depth > tolerance);
}

} // namespace driftwalk
