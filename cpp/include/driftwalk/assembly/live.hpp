// One world of blocks that keeps its state between calls, and whose parameters may change while it
// runs: the kernel of assembly/pack.hpp in double precision.
#pragma once

#include "driftwalk/assembly/bonds.hpp"
#include "driftwalk/assembly/rules.hpp"
#include "driftwalk/simulate/prepare.hpp"

#include <cstdint>
#include <memory>

namespace driftwalk {

struct LiveForces {
  double drag_coefficient = 0;
  double force_std = 0;  // [N]
  double flow_scale = 1; // on the velocity of the water
};

// Events of the last `advance`, as in AssemblyOutputs.
struct LiveEvents {
  int count;
  const std::int32_t* step;
  const std::int32_t* kind;  // null: all are joinings
  const std::int32_t* block; // [stayed, moved]
  const std::int32_t* face;
};

// Changes take effect with the next step. Memory is allocated in the constructor, and where a list
// of near pairs outgrows its room.
class LiveWorld {
public:
  // `run` has to outlive the world. Blocks [x, y, theta], as many as the rules say, start at rest,
  // at the time `flow_start` on the clock of the flow's frames [s].
  LiveWorld(const PreparedRun<double>& run, const AssemblyRules& rules, const LiveForces& forces,
            const double* start, std::uint64_t key, double flow_start = 0);
  ~LiveWorld();
  LiveWorld(const LiveWorld&) = delete;
  LiveWorld& operator=(const LiveWorld&) = delete;

  // Fewer steps where events fill their room; `step` says how many.
  void advance(std::int64_t steps);
  void set_forces(const LiveForces& forces);
  // What is joined stays so.
  void set_rules(Latching latching, double hidden_share, double stirring_length);
  // The rate at which bonds break [1/s], and how far apart what has parted has to be [side].
  void set_bonds(double rate, double relatch_clearance);
  // Blocks are of the kinds at the start again; the rules have to outlive the world.
  void set_faces(const FaceRules* faces);
  // The tables have to outlive the world.
  void set_pull(const PullRules& pull);
  // Removes the last blocks, or adds blocks at random free places, at rest, as long as there are
  // any. Returns the number of blocks, 1 to most_blocks.
  int set_blocks(int blocks);
  // Every block is on its own.
  void part();

  int blocks() const;
  std::int64_t step() const; // time steps since the start
  std::uint32_t status() const;
  LiveEvents events() const;
  void read(const LiveBlocks& out) const;
  const BondList& bonds() const; // empty where none break

private:
  struct Inside;
  std::unique_ptr<Inside> inside_;
};

} // namespace driftwalk
