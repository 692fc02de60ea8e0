// Many worlds of blocks that keep their state between calls, each with its own flow, forces and way
// of latching, which may change between any two calls.
#pragma once

#include "driftwalk/assembly/kernel.hpp"
#include "driftwalk/simulate/prepare.hpp"

#include <cstdint>
#include <vector>

namespace driftwalk {

// One of the flows that worlds may be in.
struct TankFlow {
  const PreparedRun<float>* single = nullptr; // one of the two
  const PreparedRun<double>* twice = nullptr;
  AssemblyRules rules;       // but for their latching
  std::vector<double> start; // of each world, as in AssemblyWorlds; empty: 0
};

// Of every world; arrays have an entry per world.
struct TankSettings {
  const std::int32_t* flow;     // index of its flow; -1: the world rests, as if there were no time
  const std::int32_t* latching; // a Latching
  const double* flow_scale;     // factor on the velocity of the water
  const double* drag_coefficient;
  const double* force_std; // [N]
};

class TankBatch {
public:
  // Blocks [world][block][x, y, theta] start at rest, or as `joined`, but for its pose, says. The
  // runs of the flows, and what the rules point to, have to outlive the batch.
  TankBatch(std::vector<TankFlow> flows, std::vector<std::uint64_t> key, const double* start,
            const LiveBlocks* joined, int threads);

  // All worlds go on. What a world does depends neither on the threads nor on the other worlds.
  void advance(const TankSettings& settings, std::int64_t steps, int threads);
  // Copies of some worlds, with keys of their own from the next draw of the forces on.
  TankBatch take(const std::vector<std::int64_t>& world, std::vector<std::uint64_t> key) const;

  std::int64_t worlds() const { return static_cast<std::int64_t>(key_.size()); }
  int blocks() const { return flows_.front().rules.blocks; }
  int flows() const { return static_cast<int>(flows_.size()); }
  std::int64_t step() const { return step_; }
  // Of all worlds, one after the other.
  const std::vector<double>& pose() const { return pose_; }
  const std::vector<double>& velocity() const { return velocity_; }
  const std::vector<std::int32_t>& assembly() const { return assembly_; }
  const std::vector<std::int32_t>& cell() const { return cell_; }
  const std::vector<std::int32_t>& quarter() const { return quarter_; }
  const std::vector<std::int32_t>& kind() const { return kind_; }
  const std::vector<std::uint32_t>& status() const { return status_; }
  // The step after which blocks of a world joined or parted last; 0: not since the start.
  const std::vector<std::int32_t>& last_event() const { return last_event_; }

private:
  TankBatch() = default;
  void run(const TankSettings& settings, TankGroup group, int threads);
  LiveBlocks now();

  std::vector<TankFlow> flows_;
  TankKernels kernels_; // for its whole life: what a world keeps has their layout
  std::vector<std::uint64_t> key_;
  std::int64_t step_ = 0;
  std::vector<char> state_;
  std::vector<double> pose_, velocity_;
  std::vector<std::int32_t> assembly_, cell_, quarter_, kind_, last_event_;
  std::vector<std::uint32_t> status_;
};

} // namespace driftwalk
