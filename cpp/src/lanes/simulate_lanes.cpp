// The simulation kernel, compiled once per instruction set.
#include "driftwalk/simulate/lanes.hpp"
#include "driftwalk/simulate/run.hpp"

DRIFTWALK_LANES_BEGIN

#if defined(__AVX512F__)
inline constexpr int float_lanes = 16;
#elif defined(__AVX2__)
inline constexpr int float_lanes = 8;
#else
inline constexpr int float_lanes = 4;
#endif

namespace {
void simulate(const Prepared<float>& run, const BatchWorlds& worlds, std::int64_t first, int count,
              const SampleSink<float>& sink, std::uint32_t* status) {
  run_worlds<FloatPack<float_lanes>, float>(run, worlds, first, count, sink, status);
}
} // namespace

inline constexpr SimulateKernel kernel{simulate, float_lanes};

DRIFTWALK_LANES_END

driftwalk::SimulateKernel driftwalk::DRIFTWALK_PER_ISA(simulate_kernel_)() {
  return kernel;
}
