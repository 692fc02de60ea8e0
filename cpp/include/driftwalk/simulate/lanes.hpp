// The simulation kernels of the instruction sets that this build holds.
#pragma once

#include "driftwalk/simulate/prepared.hpp"

#include <algorithm>

namespace driftwalk {

struct SimulateKernel {
  SimulateLanes run;
  int lanes; // worlds in a pack
};

// A batch cut into calls of a kernel: as many for every thread, of about as many packs each, so
// that all threads end together. The first ones are the larger ones.
class WorldCalls {
public:
  WorldCalls(const SimulateKernel& kernel, std::int64_t worlds, int threads)
      : lanes_(kernel.lanes), worlds_(worlds), packs_((worlds + lanes_ - 1) / lanes_) {
    const std::int64_t together = std::max(threads, 1);
    const std::int64_t rounds = (packs_ + together * most_packs - 1) / (together * most_packs);
    calls_ = std::min(rounds * together, packs_);
  }

  std::int64_t count() const { return calls_; }

  // The first world of a call; that of the call after the last is the number of worlds.
  std::int64_t first(std::int64_t call) const {
    return std::min(worlds_, lanes_ * (call * (packs_ / calls_) + std::min(call, packs_ % calls_)));
  }

  int size(std::int64_t call) const { return static_cast<int>(first(call + 1) - first(call)); }

  // Worlds of the largest call.
  int most() const { return calls_ == 0 ? 0 : size(0); }

private:
  std::int64_t lanes_, worlds_, packs_, calls_;
};

// The kernel of the chosen instruction set (dispatch.hpp).
SimulateKernel chosen_kernel();

SimulateKernel simulate_kernel_baseline();
SimulateKernel simulate_kernel_avx2();
SimulateKernel simulate_kernel_avx512();

} // namespace driftwalk
