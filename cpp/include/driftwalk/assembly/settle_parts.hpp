// The parts of `settle`, each in a file of its own. Doubles throughout: no number here depends on
// the instruction set, and none comes from a library's sine or cosine.
#pragma once

#include "driftwalk/assembly/scene.hpp"

#include <algorithm>
#include <cmath>

namespace driftwalk {

struct Vec2 {
  double x, y;
};
inline double dot(Vec2 a, Vec2 b) {
  return a.x * b.x + a.y * b.y;
}
inline double cross(Vec2 a, Vec2 b) {
  return a.x * b.y - a.y * b.x;
}
inline Vec2 operator+(Vec2 a, Vec2 b) {
  return {a.x + b.x, a.y + b.y};
}
inline Vec2 operator-(Vec2 a, Vec2 b) {
  return {a.x - b.x, a.y - b.y};
}
inline Vec2 operator*(Vec2 a, double s) {
  return {a.x * s, a.y * s};
}

inline const SceneAssembly& assembly_of(const Scene& scene, int block) {
  return scene.assembly[scene.block[block].assembly];
}
inline SceneAssembly& assembly_of(Scene& scene, int block) {
  return scene.assembly[scene.block[block].assembly];
}
inline Vec2 centre(const Scene& scene, int block) {
  return {scene.block[block].x, scene.block[block].y};
}
// Outward normal of face 0 .. 3 (+x, +y, -x, -y) of an assembly's frame.
inline Vec2 face_normal(const SceneAssembly& a, int face) {
  switch (face & 3) {
  case 0:
    return {a.cosine, a.sine};
  case 1:
    return {-a.sine, a.cosine};
  case 2:
    return {-a.cosine, -a.sine};
  default:
    return {a.sine, -a.cosine};
  }
}

// Squares latch on a lattice, discs and rectangles as they lie.
inline bool on_lattice(const AssemblyRules& rules) {
  return !rules.round && rules.width == 0;
}
inline double width_of(const AssemblyRules& rules) {
  return rules.width > 0 ? rules.width : rules.side;
}
inline double square_of_diagonal(const AssemblyRules& rules) {
  return rules.side * rules.side + width_of(rules) * width_of(rules);
}
// The axis of a block along its side: that of its assembly, of a rectangle its own.
inline Vec2 axis_of(const AssemblyRules& rules, const Scene& scene, int block) {
  const SceneAssembly& a = assembly_of(scene, block);
  const SceneBlock& b = scene.block[block];
  return rules.width > 0 ? Vec2{a.cosine * b.turn_cosine - a.sine * b.turn_sine,
                                a.sine * b.turn_cosine + a.cosine * b.turn_sine}
                         : Vec2{a.cosine, a.sine};
}

// How far two blocks reach towards each other along the axes of either one's side (`reach[0]`) and
// across it (`reach[1]`).
inline void find_reach(const AssemblyRules& rules, Vec2 axis_first, Vec2 axis_second,
                       double (&reach)[2]) {
  const double length = rules.side / 2, width = rules.width / 2;
  const double same = std::abs(dot(axis_first, axis_second));
  const double turned = std::abs(cross(axis_first, axis_second));
  if (on_lattice(rules)) {
    reach[0] = reach[1] = length + length * (same + turned);
    return;
  }
  reach[0] = length + length * same + width * turned;
  reach[1] = width + length * turned + width * same;
}

// Depth of the overlap of two blocks at given places with given axes, negative when clear.
inline double overlap_depth(const AssemblyRules& rules, Vec2 between, Vec2 axis_first,
                            Vec2 axis_second) {
  double reach[2];
  find_reach(rules, axis_first, axis_second, reach);
  const double along =
      std::max(std::abs(dot(between, axis_first)), std::abs(dot(between, axis_second)));
  const double across =
      std::max(std::abs(cross(axis_first, between)), std::abs(cross(axis_second, between)));
  return std::min(reach[0] - along, reach[1] - across);
}

// Whether two blocks of different assemblies overlap by more than so much.
inline bool overlap_by_more(const AssemblyRules& rules, const Scene& scene, int first, int second,
                            double than) {
  if (scene.block[first].assembly == scene.block[second].assembly) {
    return false;
  }
  const Vec2 between = centre(scene, second) - centre(scene, first);
  if (!(dot(between, between) < square_of_diagonal(rules))) {
    return false;
  }
  return (rules.round ? rules.side - std::sqrt(dot(between, between))
                      : overlap_depth(rules, between, axis_of(rules, scene, first),
                                      axis_of(rules, scene, second))) > than;
}

// The overlap of two blocks, and the axis of least penetration, which points from the first to the
// second. `reference` is the block whose face the axis is normal to.
struct Overlap {
  double depth;
  Vec2 normal;
  bool reference_is_first;
};
Overlap overlap_of(const AssemblyRules& rules, const Scene& scene, int first, int second);

// Links a block to the members of its assembly.
inline void add_member(Scene& scene, SceneAssembly& assembly, int block) {
  (assembly.blocks == 0 ? assembly.first : scene.block[assembly.last].next) = block;
  assembly.last = block;
  scene.block[block].next = -1;
  ++assembly.blocks;
}

// Puts blocks where their assembly is.
void place_members(Scene& scene, int assembly);
// Puts an assembly so that one of its blocks is at a place, and its blocks with it.
void place_by(Scene& scene, int assembly, int block, Vec2 at);
// Members, offsets, inertia and joined faces of an assembly, from its blocks' cells and labels.
void measure_assembly(const AssemblyRules& rules, Scene& scene, int assembly);
// Offsets and inertia of an assembly whose members are linked.
void measure_members(const AssemblyRules& rules, Scene& scene, int assembly);
// Which faces of its blocks have a neighbour on its lattice.
void join_faces(const AssemblyRules& rules, Scene& scene, int assembly);

// The blocks of an assembly by their cells: a table of buckets in the scene's scratch, in which the
// lattice wraps around. Has to be cleared wherever it will be looked at.
class LatticeTable {
public:
  explicit LatticeTable(Scene& scene) : scene_(scene) {}
  void clear(int x, int y) { head(x, y) = -1; }
  void add(int block) {
    std::int32_t& first = head(scene_.block[block].cell_x, scene_.block[block].cell_y);
    scene_.cell_next[block] = first;
    first = block;
  }
  // The block in a cell, -1 where there is none.
  int find(int x, int y) const {
    int b = head(x, y);
    while (b >= 0 && (scene_.block[b].cell_x != x || scene_.block[b].cell_y != y)) {
      b = scene_.cell_next[b];
    }
    return b;
  }
  bool has(int x, int y) const { return find(x, y) >= 0; }

private:
  std::int32_t& head(int x, int y) const {
    constexpr int wrap = most_cells_per_side - 1;
    return scene_.cell_head[(x & wrap) * most_cells_per_side + (y & wrap)];
  }
  Scene& scene_;
};

// How far the corner of an assembly that is farthest outside is beyond the wall [m], and the
// direction in which it has to go; negative when all are inside.
struct Beyond {
  double depth;
  Vec2 inward;
};
Beyond beyond_wall(const AssemblyRules& rules, const Scene& scene, int assembly);
// Shifts an assembly inward, corner by corner, the farthest first; false when it stays outside.
bool push_inside(const AssemblyRules& rules, Scene& scene, int assembly, int rounds);

// Whether two blocks of one assembly are neighbours: on its lattice, or as they touch.
bool are_neighbours(const AssemblyRules& rules, const Scene& scene, int first, int second);
// Makes the blocks that are labelled with the lowest of them one body, which moves on as they did
// in the assembly that they come from.
void cut_loose(const AssemblyRules& rules, Scene& scene, const SceneAssembly& from, int lowest);
// Bonds the neighbours of an assembly that are not bonded. Other bonds than that of `joined`, two
// blocks whose joining has been told, are told as events of their own.
void bond_assembly(const AssemblyRules& rules, Scene& scene, int assembly, BlockPair joined);
// Whether two assemblies have parted and are not clear of each other yet.
bool are_unclear(const Scene& scene, int assembly, int other);
// One line of the world's list of events; faces in the blocks' own frames.
void record_event(Scene& scene, EventKind kind, const int (&blocks)[2], const int (&faces)[2]);
// Whether the types of two faces, each in its assembly's frame, latch.
bool types_latch(const FaceRules& faces, const SceneBlock& block, int face, const SceneBlock& other,
                 int peer);
// Whether a merge brings at least as many pairs of like poles side by side as pairs of faces that
// latch: it would fall apart. `blocks_before` links the members of the two assemblies, of which
// these are the first.
bool poles_refuse(const FaceRules& faces, const Scene& scene, int stayed, int moved);
// Makes two blocks what they become when these faces, in their own frames, have latched.
void become(const FaceRules& faces, SceneBlock& block, int face, SceneBlock& other, int peer);

// Merges what latches, one pair of faces after the other. Leaves the list of close pairs as it then
// is.
void latch(const AssemblyRules& rules, Scene& scene);

// Impulses between blocks that overlap, and positions without overlap.
void bounce(const AssemblyRules& rules, Scene& scene);
void separate(const AssemblyRules& rules, Scene& scene);

} // namespace driftwalk
