// The simulation kernel, compiled once per instruction set.
#include "driftwalk/physics/laws/quadratic.hpp"
#include "driftwalk/simulate/lanes.hpp"
#include "driftwalk/simulate/run.hpp"

DRIFTWALK_LANES_BEGIN

namespace {
#if defined(__AVX512F__)
constexpr int float_lanes = 16;
#elif defined(__AVX2__)
constexpr int float_lanes = 8;
#else
constexpr int float_lanes = 4;
#endif

void simulate(const Prepared<float>& run, const BatchWorlds& worlds, std::int64_t first, int count,
              const SampleSink<float>& sink, std::uint32_t* status) {
  run_worlds<FloatPack<float_lanes>, float>(QuadraticDrag{}, run, worlds, first, count, sink,
                                            status);
}

constexpr SimulateKernel kernel{simulate, float_lanes};
} // namespace

DRIFTWALK_LANES_END

driftwalk::SimulateKernel driftwalk::DRIFTWALK_PER_ISA(simulate_kernel_)() {
  return kernel;
}
