// What a batch of worlds with several blocks is: plain data, no logic.
#pragma once

#include "driftwalk/assembly/face_rules.hpp"
#include "driftwalk/assembly/pull_rules.hpp"
#include "driftwalk/simulate/prepared.hpp"

#include <cstdint>

namespace driftwalk {

inline constexpr int most_blocks = 2000; // of a world

enum class Latching : int { none = 0, collision = 1, connector = 2 };

// The same for every world of a batch, in double precision. Lengths in m, SI throughout.
struct AssemblyRules {
  int blocks = 1;
  double side = 0, mass = 0, inertia = 0; // of one block
  bool round = false;                     // discs of this diameter instead of squares
  double width = 0; // of rectangles, whose side lies along their own x; 0: squares or discs
  // Blocks that are glued at the start, as many in a row as a body has; one: they start alone.
  int glued = 1;
  const std::int32_t* glued_cells = nullptr; // [glued][x, y] on the body's lattice
  // wall, as in BatchModel
  double radius = 0;
  const PreparedEdge<double>* edges = nullptr;
  int edge_count = 0;
  double low_x = 0, high_x = 0, low_y = 0, high_y = 0; // the arena's bounding box
  double bounce_speed = 0;
  // between blocks
  double restitution = 0, friction = 0;
  Latching latching = Latching::collision;
  const FaceRules* faces = nullptr; // null: any face latches with any
  double connector_distance = 0;    // largest distance between the centres of two faces that latch
  // Cosine of the largest angle between a face's normal and the other's opposite.
  double connector_cosine = 1;
  double hidden_share = 0; // of the drag of a free face that a joined face feels, 0 to 1
  // The stochastic force: over which length blocks share it [m], 0: each has its own; and whether
  // it is divergence-free.
  double stirring_length = 0;
  bool incompressible = false;
  // Bonds: whether they break at all; the rate of each without load [1/s]; the tension that
  // multiplies it by e [N], 0: none does; the tension that breaks it at once [N], 0: none; and how
  // far apart the centres of what has parted have to be before it latches again [side].
  bool bonds_break = false;
  double bond_rate = 0, bond_force = 0, bond_strength = 0, relatch_clearance = 1.25;
  PullRules pull;
};

struct AssemblyWorlds {
  std::int64_t count = 0;
  std::int64_t steps = 0;        // of every world
  const double* start = nullptr; // [world][block][x, y, theta]
  const double* drag_coefficient = nullptr;
  const double* force_std = nullptr;  // [N]
  const std::uint64_t* key = nullptr; // hash of (seed, trial, replicate)
  const double* flow_start = nullptr; // as in BatchWorlds
};

// Outputs, one row per world; events beyond event_count stay as they are. Where bonds break,
// events beyond event_rows are counted and not written.
struct AssemblyOutputs {
  std::uint32_t* status = nullptr;
  std::int32_t* event_count = nullptr;
  std::int32_t* event_step = nullptr;         // [world][event]
  std::int32_t* event_kind = nullptr;         // likewise, EventKind; null where no bonds break
  std::int32_t* event_block = nullptr;        // [world][event][stayed, moved]
  std::int32_t* event_face = nullptr;         // likewise, in the blocks' own frames
  std::int32_t* first_contact_step = nullptr; // -1: never
  std::int32_t* end_step = nullptr;
  double* pose = nullptr;           // [world][block][x, y, theta] at the end
  std::int32_t* cell = nullptr;     // [world][block][x, y] on the assembly's lattice
  std::int32_t* quarter = nullptr;  // [world][block] quarter turns of the block in its assembly
  std::int32_t* assembly = nullptr; // [world][block] lowest block of the block's assembly
  int event_rows = 0;
  // Poses every `sample_every` steps, sample 0 at the start; then no world ends early.
  int sample_every = 0;
  std::int64_t samples = 0;
  float* sample_pose = nullptr;            // [world][sample][block][x, y, theta]
  std::int32_t* sample_assembly = nullptr; // [world][sample][block]
};

// The blocks of a world that keeps its state, one row each.
struct LiveBlocks {
  double* pose;           // [x, y, theta]
  double* velocity;       // [vx, vy, omega] of the block's centre
  std::int32_t* assembly; // lowest block of its assembly
  std::int32_t* cell;     // [x, y] on the assembly's lattice
  std::int32_t* quarter;
  std::int32_t* kind; // of typed faces
};

} // namespace driftwalk
