// The same kernel in double precision, one world at a time: the reference of the batch kernels.
#include "driftwalk/particle/run.hpp"
#include "driftwalk/physics/laws/mixed.hpp"
#include "driftwalk/simulate/run.hpp"

namespace driftwalk {

void simulate_reference(const Prepared<double>& run, const BatchWorlds& worlds, std::int64_t world,
                        const SampleSink<double>& sink, std::uint32_t* status) {
  if (worlds.particle.kind != ParticleKind::none) {
    run_particle_kind<double>(run, worlds, world, 1, sink, status);
  } else if (!run.drag.is_quadratic) {
    run_worlds<double, double, MixedDrag<double>>(run, worlds, world, 1, sink, status);
  } else {
    run_worlds<double, double, QuadraticDrag>(run, worlds, world, 1, sink, status);
  }
}

} // namespace driftwalk
