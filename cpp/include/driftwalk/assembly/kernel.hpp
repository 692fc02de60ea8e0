// The self-assembly kernels of the instruction sets that this build holds.
#pragma once

#include "driftwalk/assembly/rules.hpp"
#include "driftwalk/assembly/scene.hpp"

#include <cstddef>
#include <cstdint>

namespace driftwalk {

// Worlds to be run: `take` gives the next one's number, or a number beyond the last.
struct WorldQueue {
  std::int64_t (*take)(void* self);
  void* self;
};

// Memory of one thread.
struct AssemblyScratch {
  void* lanes; // scratch_bytes(blocks), aligned to 64 bytes
  Scene scene;
};

// Runs worlds from the queue until it is empty; returns the number of block-steps.
using AssembleLanes = std::int64_t (*)(const Prepared<float>&, const AssemblyRules&,
                                       const AssemblyWorlds&, const AssemblyOutputs&,
                                       const WorldQueue&, AssemblyScratch&);

struct AssemblyKernel {
  AssembleLanes run;
  int lanes;
  std::size_t (*scratch_bytes)(int blocks);
};

AssemblyKernel chosen_assembly_kernel();
AssemblyKernel assembly_kernel_baseline();
AssemblyKernel assembly_kernel_avx2();
AssemblyKernel assembly_kernel_avx512();

// The same kernel in double precision, one world at a time.
std::int64_t assemble_reference(const Prepared<double>&, const AssemblyRules&,
                                const AssemblyWorlds&, const AssemblyOutputs&, const WorldQueue&,
                                AssemblyScratch&);
std::size_t assembly_reference_bytes(int blocks);

} // namespace driftwalk
