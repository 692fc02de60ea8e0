#include "driftwalk/simulate/simulate.hpp"

#include "driftwalk/dispatch.hpp"
#include "driftwalk/simulate/lanes.hpp"
#include "driftwalk/simulate/threads.hpp"

namespace driftwalk {

SimulateKernel chosen_kernel() {
  return DRIFTWALK_CHOSEN(simulate_kernel_);
}

void simulate_batch(const PreparedRun<float>& run, const BatchWorlds& worlds, int threads,
                    const Trajectories<float>& out) {
  const SimulateKernel kernel = chosen_kernel();
  const std::int64_t samples = run.view().samples;
  const WorldCalls calls(kernel, worlds.count, threads);
  run_tasks(calls.count(), threads, [&] {
    return [&](std::int64_t call) {
      const std::int64_t first = calls.first(call);
      const std::int64_t at = first * samples;
      const SampleSink<float> sink{out.x + at, out.y + at,
                                   out.theta == nullptr ? nullptr : out.theta + at, samples};
      kernel.run(run.view(), worlds, first, calls.size(call), sink, out.status + first);
    };
  });
}

void simulate_batch(const PreparedRun<double>& run, const BatchWorlds& worlds, int threads,
                    const Trajectories<double>& out) {
  const std::int64_t samples = run.view().samples;
  run_tasks(worlds.count, threads, [&] {
    return [&](std::int64_t world) {
      const std::int64_t at = world * samples;
      const SampleSink<double> sink{out.x + at, out.y + at,
                                    out.theta == nullptr ? nullptr : out.theta + at, samples};
      simulate_reference(run.view(), worlds, world, sink, out.status + world);
    };
  });
}

} // namespace driftwalk
