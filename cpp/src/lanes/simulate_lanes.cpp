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

using Real = FloatPack<float_lanes>;

// Particles go pack by pack.
void simulate_particles(const Prepared<float>& run, const BatchWorlds& worlds, std::int64_t first,
                        int count, const SampleSink<float>& sink, std::uint32_t* status) {
  for (int done = 0; done < count; done += float_lanes) {
    const int left = count - done;
    run_particle_kind<Real>(run, worlds, first + done, left < float_lanes ? left : float_lanes,
                            samples_from(sink, done), status + done);
  }
}

void simulate(const Prepared<float>& run, const BatchWorlds& worlds, std::int64_t first, int count,
              const SampleSink<float>& sink, std::uint32_t* status) {
  if (worlds.particle.kind != ParticleKind::none) {
    simulate_particles(run, worlds, first, count, sink, status);
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
