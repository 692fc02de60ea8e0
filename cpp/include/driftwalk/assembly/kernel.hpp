// The self-assembly kernels of the instruction sets that this build holds.
#pragma once

#include "driftwalk/assembly/rules.hpp"
#include "driftwalk/assembly/scene.hpp"
#include "driftwalk/config.hpp"

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

// Worlds of a batch that go on together from where they are: those of one flow, one factor on its
// velocity and one way of latching, at most as many as a pack has. Arrays are those of the whole
// batch, one entry per world.
struct TankGroup {
  std::int64_t step = 0, steps = 0; // so many time steps from this one on
  double flow_scale = 1;
  const std::int64_t* world = nullptr; // which they are
  int count = 0;
  const std::uint64_t* key = nullptr;
  const double* drag_coefficient = nullptr;
  const double* force_std = nullptr;  // [N]
  const double* flow_start = nullptr; // as in AssemblyWorlds
  char* state = nullptr;              // of each world kept_bytes(blocks)
  const LiveBlocks* joined = nullptr; // as they begin, where they begin with assemblies
  LiveBlocks now{};                   // read at the end; pose is read at the start too
  std::uint32_t* status = nullptr;    // likewise, bits of `Status`
  std::int32_t* last_event = nullptr; // step after which two blocks joined or parted last
  AssemblyOutputs events;             // room for those of one step, one row per lane
  bool begins = false;                // they have no state yet
};

template <class T>
struct TankKernel {
  void (*go_on)(const Prepared<T>&, const AssemblyRules&, const TankGroup&, AssemblyScratch&);
  int lanes;
  std::size_t (*scratch_bytes)(int blocks);
  std::size_t (*kept_bytes)(int blocks); // of one world
};
struct TankKernels {
  TankKernel<float> single;
  TankKernel<double> twice;
};

struct AssemblyKernel {
  AssembleLanes run;
  int lanes;
  std::size_t (*scratch_bytes)(int blocks);
};

AssemblyKernel chosen_assembly_kernel();
AssemblyKernel assembly_kernel_baseline();
AssemblyKernel assembly_kernel_avx2();
AssemblyKernel assembly_kernel_avx512();
TankKernels tank_kernels_baseline();
TankKernels tank_kernels_avx2();
TankKernels tank_kernels_avx512();

// The same kernel in double precision, one world at a time.
std::int64_t assemble_reference(const Prepared<double>&, const AssemblyRules&,
                                const AssemblyWorlds&, const AssemblyOutputs&, const WorldQueue&,
                                AssemblyScratch&);
std::size_t assembly_reference_bytes(int blocks);

} // namespace driftwalk

DRIFTWALK_LANES_BEGIN

#if defined(__AVX512F__)
inline constexpr int assembly_lanes = 16; // of a pack, worlds or blocks
#elif defined(__AVX2__)
inline constexpr int assembly_lanes = 8;
#else
inline constexpr int assembly_lanes = 4;
#endif

DRIFTWALK_LANES_END
