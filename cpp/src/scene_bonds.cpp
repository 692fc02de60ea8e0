// Bonds that break: which assemblies come apart, and when what has parted may latch again.
#include "driftwalk/assembly/settle_parts.hpp"
#include "driftwalk/random/philox.hpp"

#include <algorithm>
#include <cmath>

namespace driftwalk {

namespace {
// Hazard of a bond that forms now: from the exponential law of mean 1.
double drawn_hazard(const Scene& scene, int first, int second) {
  const Philox<UInt32> stream{static_cast<UInt32>(scene.key), static_cast<UInt32>(scene.key >> 32)};
  UInt32 words[4];
  stream(static_cast<UInt32>(scene.step), static_cast<UInt32>(first), static_cast<UInt32>(second),
         static_cast<UInt32>(Purpose::bond), words);
  const double whole = static_cast<double>(words[0]) * 0x1p21 + static_cast<double>(words[1] >> 11);
  return -std::log((whole + 0.5) * 0x1p-53);
}

bool comes_before(const Bond& bond, int first, int second) {
  return bond.first != first ? bond.first < first : bond.second < second;
}

void remove(BondList& bonds, int at) {
  std::copy(bonds.bond + at + 1, bonds.bond + bonds.count, bonds.bond + at);
  --bonds.count;
}

// The bond of two blocks, put in as a parted one where there is none.
Bond& bond_of(BondList& bonds, int first, int second) {
  int at = 0;
  while (at < bonds.count && comes_before(bonds.bond[at], first, second)) {
    ++at;
  }
  if (at < bonds.count && bonds.bond[at].first == first && bonds.bond[at].second == second) {
    return bonds.bond[at];
  }
  for (int k = 0; bonds.count == bonds.room && k < bonds.count; ++k) {
    if (bonds.bond[k].state == BondState::parted) {
      remove(bonds, k);
      at -= k < at;
    }
  }
  std::copy_backward(bonds.bond + at, bonds.bond + bonds.count, bonds.bond + bonds.count + 1);
  ++bonds.count;
  bonds.bond[at] = {static_cast<std::int16_t>(first), static_cast<std::int16_t>(second),
                    BondState::parted, 0.0};
  return bonds.bond[at];
}

// The face of a block, in its own frame, that looks at a neighbour; 0 without a lattice.
int face_at(const AssemblyRules& rules, const Scene& scene, int block, int neighbour) {
  if (!on_lattice(rules)) {
    return 0;
  }
  const SceneBlock &own = scene.block[block], &other = scene.block[neighbour];
  const int dx = other.cell_x - own.cell_x, dy = other.cell_y - own.cell_y;
  const int face = dx == 1 ? 0 : (dy == 1 ? 1 : (dx == -1 ? 2 : 3));
  return (face - own.quarter) & 3;
}

void record_of(const AssemblyRules& rules, Scene& scene, EventKind kind, int first, int second) {
  record_event(scene, kind, {first, second},
               {face_at(rules, scene, first, second), face_at(rules, scene, second, first)});
}

// Whether neighbours are bonded: those that have just latched, and those whose faces may. Where
// none has latched all are.
bool can_bond(const AssemblyRules& rules, const Scene& scene, int first, int second,
              BlockPair joined) {
  if (rules.faces == nullptr || joined.first < 0 ||
      (std::min(joined.first, joined.second) == first &&
       std::max(joined.first, joined.second) == second)) {
    return true;
  }
  const SceneBlock &own = scene.block[first], &other = scene.block[second];
  const int face = face_at(rules, scene, first, second) + own.quarter;
  return types_latch(*rules.faces, own, face & 3, other, (face + 2) & 3);
}

// Moves a body's cells so that its lowest block is at the origin: they never leave their range.
void begin_lattice(Scene& scene, int lowest) {
  const int x = scene.block[lowest].cell_x, y = scene.block[lowest].cell_y;
  for (int b = scene.assembly[lowest].first; b >= 0; b = scene.block[b].next) {
    scene.block[b].cell_x -= x;
    scene.block[b].cell_y -= y;
  }
}

// Cuts an assembly in two: the blocks marked in `side`, and the others.
void cut(const AssemblyRules& rules, Scene& scene, int assembly, const std::int32_t* side) {
  const SceneAssembly from = scene.assembly[assembly];
  // Neighbours that no bond has held have to become clear of each other too.
  for (int b = from.first; rules.faces != nullptr && b >= 0; b = scene.block[b].next) {
    for (int c = scene.block[b].next; c >= 0; c = scene.block[c].next) {
      if (side[b] != side[c] && are_neighbours(rules, scene, b, c)) {
        bond_of(scene.bonds, b, c);
      }
    }
  }
  int lowest[2] = {-1, -1};
  for (int b = from.first; b >= 0; b = scene.block[b].next) {
    int& own = lowest[side[b]];
    own = own < 0 ? b : own;
    scene.block[b].assembly = own;
  }
  for (const int low : lowest) {
    cut_loose(rules, scene, from, low);
    begin_lattice(scene, low);
  }
  ++scene.assemblies;
  for (int k = 0; k < scene.bonds.count; ++k) {
    Bond& bond = scene.bonds.bond[k];
    if (scene.block[bond.first].assembly != scene.block[bond.second].assembly) {
      bond.state = BondState::parted;
    }
  }
}
} // namespace

bool find_side(const BondList& bonds, int blocks, const Bond& bond, std::int32_t* side) {
  std::fill_n(side, blocks, 0);
  side[bond.first] = 1;
  for (bool grows = true; grows;) {
    grows = false;
    for (int k = 0; k < bonds.count; ++k) {
      const Bond& b = bonds.bond[k];
      if (b.state == BondState::whole && &b != &bond && side[b.first] != side[b.second]) {
        side[b.first] = side[b.second] = 1;
        grows = true;
      }
    }
  }
  return side[bond.second] == 0;
}

void record_event(Scene& scene, EventKind kind, const int (&blocks)[2], const int (&faces)[2]) {
  const int e = scene.event_count;
  if (e < scene.event_rows) {
    scene.event_step[e] = scene.step;
    if (scene.event_kind != nullptr) {
      scene.event_kind[e] = static_cast<std::int32_t>(kind);
    }
    for (int side = 0; side < 2; ++side) {
      scene.event_block[2 * e + side] = blocks[side];
      scene.event_face[2 * e + side] = faces[side];
    }
  } else if (scene.event_kind == nullptr) {
    return;
  }
  ++scene.event_count;
}

void bond_assembly(const AssemblyRules& rules, Scene& scene, int assembly, BlockPair joined) {
  BondList& bonds = scene.bonds;
  for (int b = scene.assembly[assembly].first; b >= 0; b = scene.block[b].next) {
    for (int c = scene.block[b].next; c >= 0; c = scene.block[c].next) {
      // What has lain side by side in one of the two before is as it was.
      if (joined.first >= 0 && scene.blocks_before[b].assembly == scene.blocks_before[c].assembly) {
        continue;
      }
      if (!are_neighbours(rules, scene, b, c) || !can_bond(rules, scene, b, c, joined)) {
        continue;
      }
      Bond& bond = bond_of(bonds, b, c);
      if (bond.state == BondState::parted) {
        bond.state = BondState::whole;
        bond.left = drawn_hazard(scene, b, c);
        if (std::min(joined.first, joined.second) != b ||
            std::max(joined.first, joined.second) != c) {
          record_of(rules, scene, EventKind::closing, b, c);
        }
      }
    }
  }
  // What another way has brought together again is no parted pair.
  for (int k = bonds.count - 1; k >= 0; --k) {
    const Bond& bond = bonds.bond[k];
    if (bond.state == BondState::parted &&
        scene.block[bond.first].assembly == scene.block[bond.second].assembly) {
      remove(bonds, k);
    }
  }
}

void bond_all(const AssemblyRules& rules, Scene& scene) {
  scene.bonds.count = 0;
  for (int a = 0; a < scene.blocks; ++a) {
    if (scene.assembly[a].blocks > 1) {
      bond_assembly(rules, scene, a, {-1, -1});
    }
  }
}

void drop_bonds(const Scene& scene, BondList& bonds) {
  int count = 0;
  for (int k = 0; k < bonds.count; ++k) {
    Bond bond = bonds.bond[k];
    if (bond.second >= scene.blocks) {
      continue;
    }
    if (scene.block[bond.first].assembly != scene.block[bond.second].assembly) {
      bond.state = BondState::parted;
    }
    bonds.bond[count++] = bond;
  }
  bonds.count = count;
}

bool are_unclear(const Scene& scene, int assembly, int other) {
  for (int k = 0; k < scene.bonds.count; ++k) {
    const Bond& bond = scene.bonds.bond[k];
    const int one = scene.block[bond.first].assembly, two = scene.block[bond.second].assembly;
    if (bond.state == BondState::parted &&
        ((one == assembly && two == other) || (one == other && two == assembly))) {
      return true;
    }
  }
  return false;
}

void break_bonds(const AssemblyRules& rules, Scene& scene) {
  std::int32_t* const side = scene.cell_next; // of the pair search, which is over
  for (int k = 0; k < scene.bonds.count; ++k) {
    Bond& bond = scene.bonds.bond[k];
    if (bond.state != BondState::whole || bond.left > 0) {
      continue;
    }
    bond.state = BondState::open;
    const int first = bond.first, second = bond.second;
    if (!find_side(scene.bonds, scene.blocks, bond, side)) {
      record_of(rules, scene, EventKind::opening, first, second);
      continue;
    }
    // First the block of the larger part, of equal ones of that with the lowest block.
    const int assembly = scene.block[first].assembly;
    const int sided = static_cast<int>(std::count(side, side + scene.blocks, 1));
    const int others = scene.assembly[assembly].blocks - sided;
    const bool first_stays = sided != others ? sided > others : side[assembly] == 1;
    record_of(rules, scene, EventKind::parting, first_stays ? first : second,
              first_stays ? second : first);
    cut(rules, scene, assembly, side);
    scene.rebuilt = true;
  }
}

} // namespace driftwalk
