// The simulation kernels of the instruction sets that this build holds.
#pragma once

#include "driftwalk/simulate/prepared.hpp"

namespace driftwalk {

struct SimulateKernel {
  SimulateLanes run;
  int lanes; // worlds per call
};

// The kernel of the chosen instruction set (dispatch.hpp).
SimulateKernel chosen_kernel();

SimulateKernel simulate_kernel_baseline();
SimulateKernel simulate_kernel_avx2();
SimulateKernel simulate_kernel_avx512();

} // namespace driftwalk
