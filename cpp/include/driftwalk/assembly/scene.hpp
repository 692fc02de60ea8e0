// One world with several blocks in plain numbers: what contacts and latching work on.
//
// Read by code of every instruction set (see config.hpp): plain data, and no function but those
// that each set has of its own.
#pragma once

#include "driftwalk/assembly/bonds.hpp"
#include "driftwalk/assembly/rules.hpp"
#include "driftwalk/config.hpp"

#include <cstdint>

namespace driftwalk {

struct SceneBlock {
  int assembly;       // lowest block of its assembly
  int next;           // next member of the assembly, -1 after the last
  int cell_x, cell_y; // on the assembly's lattice
  int quarter;        // its own frame is the assembly's turned by this many quarter turns
  std::uint8_t kind;  // of typed faces
  unsigned joined;    // bit f: face f (of the assembly's frame) has a neighbour
  // In place of the quarter turns, of what latches as it lies [rad], 0 to 2 pi.
  double turn, turn_cosine, turn_sine;
  double offset_x, offset_y; // from the centre of mass, in the assembly's frame [m]
  double x, y;               // position [m]
};

struct ScenePose {
  double x, y, theta;
  double cosine, sine; // of theta
};

// A rigid assembly, kept at the index of its lowest block.
struct SceneAssembly {
  int blocks;      // 0: not the lowest block of any
  int first, last; // members, in the order of `next`
  double x, y, theta;
  double cosine, sine; // of theta
  double vx, vy, omega;
  double inertia;   // about its centre of mass [kg m^2]
  ScenePose before; // at the start of the step
  bool touched;     // an impulse or a merge changed it
  int moved;        // last round of `separate` in which it was moved
};

// Two blocks that may be near each other, first < second.
struct BlockPair {
  std::int32_t first, second;
};

// Pairs of blocks that may touch.
struct PairList {
  BlockPair* pair;
  int count, room;
  // Makes room for twice as many, in what owns them; none where there is room for all pairs.
  BlockPair* (*grow)(void* owner, int room);
  void* owner;
};

// What the pair search reads of a block.
struct PlacedBlock {
  double x, y;
  std::int32_t assembly, block;
};

struct Scene {
  int blocks;
  int assemblies;
  SceneBlock* block;
  SceneBlock* blocks_before; // scratch of as many
  SceneAssembly* assembly;
  PairList pairs;
  PairList close; // those of them that may touch or latch, as the scene is now
  // scratch of the pair search and of lattices: first block of every cell, next in the same cell
  std::int32_t* cell_head;
  std::int32_t* cell_next;
  PlacedBlock* by_cell; // scratch: the blocks, cell by cell
  // where bonds break
  BondList bonds;
  std::uint64_t key; // of the world's random numbers
  // what happened, written by settle
  bool contact; // two blocks of different assemblies overlapped or latched
  bool rebuilt; // a merge moved blocks: lists of near pairs are out of date
  int event_rows, event_count;
  std::int32_t step; // written into events
  std::int32_t* event_step;
  std::int32_t* event_kind; // null where no bonds break
  std::int32_t* event_block;
  std::int32_t* event_face;
};

// Cells of the pair search are this many a side at most.
inline constexpr int most_cells_per_side = 64;
inline constexpr int cell_heads = most_cells_per_side * most_cells_per_side + 2;
// Lists of near pairs reach this many sides farther than what touches or latches.
inline constexpr double pair_skin_sides = 0.7;
// Discs, or rectangles, of one assembly are in contact up to this gap, in diameters or longer
// sides; chosen by hand: it is what two of them move in a time step.
inline constexpr double contact_gap = 0.01;
// Up to this many blocks every pair is looked at; beyond, lists of near pairs.
inline constexpr int most_blocks_all_pairs = 24;

// Latches, impulses and positions of everything that touches (docs/explanation/assembly.md).
void settle(const AssemblyRules& rules, Scene& scene);

// Leaves the first `blocks` blocks alone in the scene. What is left of an assembly that has lost
// some goes on as it was moving; where its blocks no longer hang together it is several assemblies.
// Those are marked as touched.
void keep_first_blocks(const AssemblyRules& rules, Scene& scene, int blocks);
// Glues blocks to the bodies of the start, each where its first block is.
void glue_blocks(const AssemblyRules& rules, Scene& scene);
// Makes assemblies of blocks that are alone, each where its lowest block is and as that one moves.
void join_blocks(const AssemblyRules& rules, Scene& scene, const LiveBlocks& joined);
// Makes every block an assembly of its own, which moves as the block did, with its own frame.
void part_blocks(const AssemblyRules& rules, Scene& scene);

// Breaks the bonds that have no hazard left; assemblies come apart where one was a bridge.
void break_bonds(const AssemblyRules& rules, Scene& scene);
// Bonds all neighbours of all assemblies anew.
void bond_all(const AssemblyRules& rules, Scene& scene);
// Forgets the bonds of blocks that are gone; those across assemblies have parted.
void drop_bonds(const Scene& scene, BondList& bonds);
// Marks the blocks on the side of a bond's first block, without crossing it: 1 in `side`, which has
// an entry per block and 0 for all others. Returns whether it is a bridge.
bool find_side(const BondList& bonds, int blocks, const Bond& bond, std::int32_t* side);

// Fills the list with the pairs of different assemblies whose centres are closer than a diagonal
// (or the connectors' reach) and a skin, ordered by first and second block. It has to be made anew
// where an assembly has come apart. The list of close pairs is then void.
void find_pairs(const AssemblyRules& rules, Scene& scene);
// Fills the list of close pairs from that of near ones, in their order.
void find_close_pairs(const AssemblyRules& rules, Scene& scene);

} // namespace driftwalk

DRIFTWALK_LANES_BEGIN

// Room for all pairs that there are.
inline constexpr int pair_capacity(int blocks) {
  return blocks * (blocks - 1) / 2;
}

DRIFTWALK_LANES_END
