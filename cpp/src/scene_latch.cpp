// Latching: two faces that meet make two assemblies one, on the lattice of the heavier. Discs and
// rectangles that meet do so as they lie.
#include "driftwalk/assembly/settle_parts.hpp"

#include <algorithm>
#include <cmath>

namespace driftwalk {

namespace {
struct Candidate {
  int first, face, second, peer; // faces in the frames of their assemblies; 0 without a lattice
  double squared;                // distance of the face centres, or of the blocks' [m^2]
};

bool comes_before(const Candidate& a, const Candidate& b) {
  if (a.squared != b.squared) {
    return a.squared < b.squared;
  }
  if (a.first != b.first) {
    return a.first < b.first;
  }
  if (a.face != b.face) {
    return a.face < b.face;
  }
  return a.second != b.second ? a.second < b.second : a.peer < b.peer;
}

bool is_free(const Scene& scene, int block, int face) {
  return (scene.block[block].joined >> face & 1u) == 0;
}

// Whether two free faces can latch, by the rule in force.
bool can_latch(const AssemblyRules& rules, const Scene& scene, Candidate& c) {
  const Vec2 between = centre(scene, c.second) - centre(scene, c.first);
  if (!on_lattice(rules)) {
    c.squared = dot(between, between);
    return c.face == 0 && c.peer == 0;
  }
  if (rules.faces != nullptr &&
      !types_latch(*rules.faces, scene.block[c.first], c.face, scene.block[c.second], c.peer)) {
    return false;
  }
  const Vec2 n = face_normal(assembly_of(scene, c.first), c.face);
  const Vec2 m = face_normal(assembly_of(scene, c.second), c.peer);
  const Vec2 gap = between + (m - n) * (rules.side / 2);
  c.squared = dot(gap, gap);
  if (rules.latching == Latching::collision) {
    return dot(n, between) > 0 && dot(m, between) < 0 && dot(n, m) < 0;
  }
  return c.squared <= rules.connector_distance * rules.connector_distance &&
         -dot(n, m) >= rules.connector_cosine;
}

// How the moved assembly's lattice lies on the other's: turned, then shifted.
struct OntoLattice {
  int quarters, shift_x, shift_y;

  static void turn(int quarters, int x, int y, int& out_x, int& out_y) {
    constexpr int cosine[4] = {1, 0, -1, 0}, sine[4] = {0, 1, 0, -1};
    out_x = cosine[quarters] * x - sine[quarters] * y;
    out_y = sine[quarters] * x + cosine[quarters] * y;
  }
  void apply(SceneBlock& block) const {
    int x, y;
    turn(quarters, block.cell_x, block.cell_y, x, y);
    block.cell_x = x + shift_x;
    block.cell_y = y + shift_y;
    block.quarter = (block.quarter + quarters) & 3;
  }
};

struct Merge {
  int anchor, anchor_face; // a block of the assembly that stays
  int guest, guest_face;   // a block of the one that is moved
  int stays, moves;
  OntoLattice onto;
};

Merge plan(const Scene& scene, const Candidate& c) {
  const int a = scene.block[c.first].assembly, b = scene.block[c.second].assembly;
  const int blocks_a = scene.assembly[a].blocks, blocks_b = scene.assembly[b].blocks;
  const bool first_stays = blocks_a != blocks_b ? blocks_a > blocks_b : a < b;
  Merge merge = first_stays ? Merge{c.first, c.face, c.second, c.peer, a, b, {}}
                            : Merge{c.second, c.peer, c.first, c.face, b, a, {}};
  // The guest's face turns to look against the anchor's.
  merge.onto.quarters = (merge.anchor_face + 2 - merge.guest_face) & 3;
  constexpr int step_x[4] = {1, 0, -1, 0}, step_y[4] = {0, 1, 0, -1};
  const SceneBlock& anchor = scene.block[merge.anchor];
  const SceneBlock& guest = scene.block[merge.guest];
  int x, y;
  OntoLattice::turn(merge.onto.quarters, guest.cell_x, guest.cell_y, x, y);
  merge.onto.shift_x = anchor.cell_x + step_x[merge.anchor_face] - x;
  merge.onto.shift_y = anchor.cell_y + step_y[merge.anchor_face] - y;
  return merge;
}

bool cells_are_free(Scene& scene, const Merge& merge) {
  const int stays = scene.assembly[merge.stays].first, moves = scene.assembly[merge.moves].first;
  LatticeTable cells(scene);
  const auto moved = [&](int block) {
    SceneBlock copy = scene.block[block];
    merge.onto.apply(copy);
    return copy;
  };
  for (int b = moves; b >= 0; b = scene.block[b].next) {
    cells.clear(moved(b).cell_x, moved(b).cell_y);
  }
  for (int b = stays; b >= 0; b = scene.block[b].next) {
    cells.clear(scene.block[b].cell_x, scene.block[b].cell_y);
  }
  for (int b = stays; b >= 0; b = scene.block[b].next) {
    cells.add(b);
  }
  for (int b = moves; b >= 0; b = scene.block[b].next) {
    if (cells.has(moved(b).cell_x, moved(b).cell_y)) {
      return false;
    }
  }
  return true;
}

// Where a block was before the step.
Vec2 place_before(const Scene& scene, int block) {
  const ScenePose& before = assembly_of(scene, block).before;
  const Vec2 axis{before.cosine, before.sine}, across{-before.sine, before.cosine};
  const SceneBlock& b = scene.block[block];
  return Vec2{before.x, before.y} + axis * b.offset_x + across * b.offset_y;
}

// Whether two blocks of different assemblies overlap, as they are or with the other where it was:
// a jam takes it back there.
bool overlaps(const AssemblyRules& rules, const Scene& scene, int block, int other, Vec2 was) {
  constexpr double tolerance = 1e-4;
  if (overlap_by_more(rules, scene, block, other, tolerance)) {
    return true;
  }
  const Vec2 between = was - centre(scene, block);
  const ScenePose& before = assembly_of(scene, other).before;
  return dot(between, between) < 2 * rules.side * rules.side &&
         overlap_depth(rules, between, face_normal(assembly_of(scene, block), 0),
                       {before.cosine, before.sine}) > tolerance;
}

// Members of an assembly by the cells of its lattice, for whatever comes near them: as
// `blocks_before` links them, from one on.
class MembersByCell {
public:
  MembersByCell(const AssemblyRules& rules, Scene& scene, int first)
      : cells_(scene), origin_(scene.block[first]), per_side_(1.0 / rules.side),
        axis_(face_normal(assembly_of(scene, first), 0)), low_x_(origin_.cell_x), high_x_(low_x_),
        low_y_(origin_.cell_y), high_y_(low_y_) {
    for (int b = first; b >= 0; b = scene.blocks_before[b].next) {
      const SceneBlock& block = scene.block[b];
      low_x_ = std::min(low_x_, block.cell_x);
      high_x_ = std::max(high_x_, block.cell_x);
      low_y_ = std::min(low_y_, block.cell_y);
      high_y_ = std::max(high_y_, block.cell_y);
    }
    for (int x = low_x_; x <= high_x_; ++x) {
      for (int y = low_y_; y <= high_y_; ++y) {
        cells_.clear(x, y);
      }
    }
    for (int b = first; b >= 0; b = scene.blocks_before[b].next) {
      cells_.add(b);
    }
  }

  // Whether the condition holds of any member closer to a place than `reach`, or hardly farther.
  template <class Condition>
  bool any_near(Vec2 place, double reach, const Condition& holds) const {
    const Vec2 away = (place - Vec2{origin_.x, origin_.y}) * per_side_;
    const double range = reach * per_side_;
    const double x = origin_.cell_x + dot(away, axis_), y = origin_.cell_y + cross(axis_, away);
    const int right = static_cast<int>(std::min<double>(high_x_, std::floor(x + range)));
    const int top = static_cast<int>(std::min<double>(high_y_, std::floor(y + range)));
    const int left = static_cast<int>(std::max<double>(low_x_, std::ceil(x - range)));
    const int bottom = static_cast<int>(std::max<double>(low_y_, std::ceil(y - range)));
    for (int column = left; column <= right; ++column) {
      for (int row = bottom; row <= top; ++row) {
        const int block = cells_.find(column, row);
        if (block >= 0 && holds(block)) {
          return true;
        }
      }
    }
    return false;
  }

private:
  LatticeTable cells_;
  const SceneBlock& origin_;
  double per_side_;
  Vec2 axis_;
  int low_x_, high_x_, low_y_, high_y_;
};

// Whether members of an assembly, as `blocks_before` links them from one on, are clear of all
// others. Only what may be near is looked at: assemblies within a circle, of these blocks, of these
// the members that they may touch as they are or were.
bool are_clear_of_others(const AssemblyRules& rules, Scene& scene, int first) {
  const Vec2 middle = centre(scene, first);
  const auto square_from_middle = [&](Vec2 place) {
    const Vec2 from_middle = place - middle;
    return dot(from_middle, from_middle);
  };
  double farthest = 0;
  for (int b = first; b >= 0; b = scene.blocks_before[b].next) {
    farthest = std::max(farthest, square_from_middle(centre(scene, b)));
  }
  const MembersByCell members(rules, scene, first);
  const double touching = 1.42 * rules.side; // a diagonal and a little more
  const double reach = std::sqrt(farthest) + touching;
  for (int other = 0; other < scene.blocks; ++other) {
    const SceneAssembly& others = scene.assembly[other];
    if (others.blocks == 0 || other == scene.block[first].assembly) {
      continue;
    }
    // The square of a member's distance times a block's mass is a part of the moment of inertia,
    // and so no more than it; the factor is for rounding.
    const double within = reach + std::sqrt(1.001 * others.inertia / rules.mass);
    if (square_from_middle({others.x, others.y}) > within * within &&
        square_from_middle({others.before.x, others.before.y}) > within * within) {
      continue;
    }
    for (int c = others.first; c >= 0; c = scene.block[c].next) {
      const Vec2 is = centre(scene, c), was = place_before(scene, c);
      if (square_from_middle(is) > reach * reach && square_from_middle(was) > reach * reach) {
        continue;
      }
      if (members.any_near(is, touching + std::sqrt(dot(is - was, is - was)),
                           [&](int b) { return overlaps(rules, scene, b, c, was); })) {
        return false;
      }
    }
  }
  return true;
}

// Velocity and spin of the joint body: linear momentum, and angular momentum about the joint centre
// of mass, of the two before they are aligned. `inertia` is that of the aligned body.
void conserve_momentum(const SceneAssembly& a, const SceneAssembly& b, double mass,
                       SceneAssembly& joint) {
  const double ma = mass * a.blocks, mb = mass * b.blocks, m = ma + mb;
  const Vec2 middle{(ma * a.x + mb * b.x) / m, (ma * a.y + mb * b.y) / m};
  const double spin = a.inertia * a.omega + b.inertia * b.omega +
                      ma * cross(Vec2{a.x, a.y} - middle, {a.vx, a.vy}) +
                      mb * cross(Vec2{b.x, b.y} - middle, {b.vx, b.vy});
  joint.vx = (ma * a.vx + mb * b.vx) / m;
  joint.vy = (ma * a.vy + mb * b.vy) / m;
  joint.omega = spin / joint.inertia;
}

void align(Scene& scene, const Merge& merge, int joint) {
  for (int b = scene.assembly[merge.moves].first; b >= 0; b = scene.block[b].next) {
    merge.onto.apply(scene.block[b]);
    scene.block[b].assembly = joint;
  }
  for (int b = scene.assembly[merge.stays].first; b >= 0; b = scene.block[b].next) {
    scene.block[b].assembly = joint;
  }
}

// Turns a block in the frame of its assembly, from that of another one.
void turn_by(SceneBlock& block, double angle, Vec2 onto) {
  constexpr double full_turn = 2 * 3.141592653589793;
  block.turn += angle;
  block.turn -= full_turn * std::floor(block.turn / full_turn);
  const double c = onto.x * block.turn_cosine - onto.y * block.turn_sine;
  const double s = onto.y * block.turn_cosine + onto.x * block.turn_sine;
  const double length = std::sqrt(c * c + s * s);
  block.turn_cosine = c / length;
  block.turn_sine = s / length;
}

// Discs and rectangles stay as they lie, but for their overlap: both move apart, in inverse
// proportion to their masses.
void join_as_they_lie(const AssemblyRules& rules, Scene& scene, const Merge& merge, int joint) {
  SceneAssembly &stays = scene.assembly[merge.stays], &moves = scene.assembly[merge.moves];
  const Overlap overlap = overlap_of(rules, scene, merge.anchor, merge.guest);
  const Vec2 share = overlap.normal * (overlap.depth / (stays.blocks + moves.blocks));
  const double turned = moves.theta - stays.theta;
  const Vec2 onto{dot(face_normal(stays, 0), face_normal(moves, 0)),
                  cross(face_normal(stays, 0), face_normal(moves, 0))};
  for (int b = stays.first; b >= 0; b = scene.block[b].next) {
    SceneBlock& block = scene.block[b];
    block.x -= share.x * moves.blocks;
    block.y -= share.y * moves.blocks;
    block.assembly = joint;
  }
  for (int b = moves.first; b >= 0; b = scene.block[b].next) {
    SceneBlock& block = scene.block[b];
    block.x += share.x * stays.blocks;
    block.y += share.y * stays.blocks;
    block.assembly = joint;
    turn_by(block, turned, onto);
  }
}

// Copies the members of an assembly, as it was, from one array of blocks to another.
void copy_members(const SceneAssembly& of, const SceneBlock* from, SceneBlock* to) {
  for (int b = of.first; b >= 0; b = from[b].next) {
    to[b] = from[b];
  }
}

// Links the members of two assemblies, each in order, to one in order.
void link_both(Scene& scene, const SceneAssembly& a, const SceneAssembly& b, SceneAssembly& joint) {
  int first = a.first, second = b.first;
  joint.blocks = 0;
  joint.first = joint.last = -1;
  while (first >= 0 || second >= 0) {
    int& next = second < 0 || (first >= 0 && first < second) ? first : second;
    const int block = next;
    next = scene.block[block].next;
    add_member(scene, joint, block);
  }
}

// Moves the guests' assembly onto the other's lattice. False, and nothing changed, when the two
// would overlap each other or a third, or cannot both be inside the tank. What would overlap
// without a lattice latches next.
bool try_merge(const AssemblyRules& rules, Scene& scene, const Merge& merge) {
  if (on_lattice(rules) && !cells_are_free(scene, merge)) {
    return false;
  }
  constexpr int most_rounds = 64;
  const SceneAssembly kept = scene.assembly[merge.stays], moved = scene.assembly[merge.moves];
  const int joint = std::min(merge.stays, merge.moves);
  const int own_faces[2] = {(merge.anchor_face - scene.block[merge.anchor].quarter) & 3,
                            (merge.guest_face - scene.block[merge.guest].quarter) & 3};
  copy_members(kept, scene.block, scene.blocks_before);
  copy_members(moved, scene.block, scene.blocks_before);
  if (on_lattice(rules)) {
    align(scene, merge, joint);
  } else {
    join_as_they_lie(rules, scene, merge, joint);
  }
  const Vec2 anchor = centre(scene, merge.anchor);
  scene.assembly[std::max(merge.stays, merge.moves)].blocks = 0;
  SceneAssembly& body = scene.assembly[joint];
  body = kept;
  link_both(scene, kept, moved, body);
  measure_members(rules, scene, joint);
  conserve_momentum(kept, moved, rules.mass, body);
  place_by(scene, joint, merge.anchor, anchor);
  if (!push_inside(rules, scene, joint, most_rounds) ||
      // Those that have moved first: they are more often in the way, and fewer.
      (on_lattice(rules) && !(are_clear_of_others(rules, scene, moved.first) &&
                              are_clear_of_others(rules, scene, kept.first))) ||
      (rules.faces != nullptr && poles_refuse(*rules.faces, scene, kept.first, moved.first))) {
    copy_members(kept, scene.blocks_before, scene.block);
    copy_members(moved, scene.blocks_before, scene.block);
    scene.assembly[merge.stays] = kept;
    scene.assembly[merge.moves] = moved;
    return false;
  }
  join_faces(rules, scene, joint);
  body.before = {body.x, body.y, body.theta, body.cosine, body.sine};
  body.touched = true;
  --scene.assemblies;
  record_event(scene, EventKind::joining, {merge.anchor, merge.guest}, own_faces);
  if (rules.bonds_break) {
    bond_assembly(rules, scene, joint, {merge.anchor, merge.guest});
  }
  if (rules.faces != nullptr) {
    become(*rules.faces, scene.block[merge.anchor], own_faces[0], scene.block[merge.guest],
           own_faces[1]);
  }
  return true;
}

// Whether any faces of two blocks can latch at all.
bool may_latch(const AssemblyRules& rules, const Scene& scene, BlockPair pair) {
  const int own = scene.block[pair.first].assembly, other = scene.block[pair.second].assembly;
  if (own == other || are_unclear(scene, own, other)) {
    return false;
  }
  if (rules.latching == Latching::collision) {
    return overlap_by_more(rules, scene, pair.first, pair.second, 0);
  }
  const Vec2 between = centre(scene, pair.second) - centre(scene, pair.first);
  const double reach = rules.side + rules.connector_distance;
  return dot(between, between) <= reach * reach;
}

// The best candidate that comes after `last`, if any: candidates are tried in their order without a
// list of them.
bool next_candidate(const AssemblyRules& rules, const Scene& scene, const Candidate& last,
                    Candidate& best) {
  bool found = false;
  for (int k = 0; k < scene.close.count; ++k) {
    const BlockPair pair = scene.close.pair[k];
    if (!may_latch(rules, scene, pair)) {
      continue;
    }
    for (int face = 0; face < 4; ++face) {
      for (int peer = 0; peer < 4; ++peer) {
        Candidate c{pair.first, face, pair.second, peer, 0};
        if (is_free(scene, pair.first, face) && is_free(scene, pair.second, peer) &&
            can_latch(rules, scene, c) && comes_before(last, c) &&
            (!found || comes_before(c, best))) {
          best = c;
          found = true;
        }
      }
    }
  }
  return found;
}

bool merge_one(const AssemblyRules& rules, Scene& scene) {
  Candidate last{-1, -1, -1, -1, -1.0}, best{};
  while (next_candidate(rules, scene, last, best)) {
    if (try_merge(rules, scene, plan(scene, best))) {
      return true;
    }
    last = best;
  }
  return false;
}
} // namespace

void latch(const AssemblyRules& rules, Scene& scene) {
  find_close_pairs(rules, scene);
  if (rules.latching == Latching::none) {
    return;
  }
  while (merge_one(rules, scene)) {
    scene.contact = true;
    scene.rebuilt = true;
    find_pairs(rules, scene);
    find_close_pairs(rules, scene);
  }
}

} // namespace driftwalk
