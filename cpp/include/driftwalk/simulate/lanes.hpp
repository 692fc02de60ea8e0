// The simulation kernels of the instruction sets that this build holds.
#pragma once

#include "driftwalk/simulate/prepared.hpp"

#include <algorithm>

namespace driftwalk {

struct SimulateKernel {
  SimulateLanes run;
  int lanes; // worlds in a pack
};

// How many worlds a call should take: several packs, as long as no thread goes without.
inline int worlds_per_call(const SimulateKernel& kernel, std::int64_t worlds, int threads) {
  const std::int64_t packs = (worlds + kernel.lanes - 1) / kernel.lanes;
  const std::int64_t share = packs / std::max(threads, 1);
  return kernel.lanes * static_cast<int>(std::clamp<std::int64_t>(share, 1, most_packs));
}

// The kernel of the chosen instruction set (dispatch.hpp).
SimulateKernel chosen_kernel();

SimulateKernel simulate_kernel_baseline();
SimulateKernel simulate_kernel_avx2();
SimulateKernel simulate_kernel_avx512();

} // namespace driftwalk
