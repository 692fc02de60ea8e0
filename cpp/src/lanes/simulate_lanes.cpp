// The simulation kernel, compiled once per instruction set.
#include "driftwalk/particle/run.hpp"
#include "driftwalk/physics/laws/mixed.hpp"
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
  using Real = FloatPack<float_lanes>;
  if (worlds.particle.kind != ParticleKind::none) {
    run_particle_kind<Real>(run, worlds, first, count, sink, status);
  } else if (!run.drag.is_quadratic) {
    run_worlds<Real, float, MixedDrag<Real>>(run, worlds, first, count, sink, status);
  } else {
    run_worlds<Real, float, QuadraticDrag>(run, worlds, first, count, sink, status);
  }
}

constexpr SimulateKernel kernel{simulate, float_lanes};
} // namespace

DRIFTWALK_LANES_END

driftwalk::SimulateKernel driftwalk::DRIFTWALK_PER_ISA(simulate_kernel_)() {
  return kernel;
}
