#include "driftwalk/assembly/assemble.hpp"

#include "driftwalk/assembly/memory.hpp"
#include "driftwalk/dispatch.hpp"
#include "driftwalk/simulate/threads.hpp"

#include <algorithm>
#include <atomic>
#include <memory>

namespace driftwalk {

AssemblyKernel chosen_assembly_kernel() {
  return DRIFTWALK_CHOSEN(assembly_kernel_);
}

namespace {
std::int64_t take_next(void* self) {
  return (*static_cast<std::atomic<std::int64_t>*>(self))++;
}

// Every thread runs packs of its own and takes worlds from one queue.
template <class Run>
std::int64_t run_threads(int blocks, std::int64_t worlds, int lanes, int threads,
                         std::size_t lane_bytes, const Run& run) {
  std::atomic<std::int64_t> next{0}, block_steps{0};
  const WorldQueue queue{take_next, &next};
  const std::int64_t packs = (worlds + lanes - 1) / lanes;
  const std::int64_t tasks = std::min<std::int64_t>(std::max(threads, 1), packs);
  run_tasks(tasks, threads, [&] {
    return [&](std::int64_t) {
      const auto memory = std::make_unique<AssemblyMemory>(blocks, lane_bytes);
      block_steps += run(queue, memory->scratch());
    };
  });
  return block_steps;
}
} // namespace

std::int64_t assemble_batch(const PreparedRun<float>& run, const AssemblyRules& rules,
                            const AssemblyWorlds& worlds, int threads, const AssemblyOutputs& out) {
  const AssemblyKernel kernel = chosen_assembly_kernel();
  const int at_once = rules.blocks > most_blocks_all_pairs ? 1 : kernel.lanes;
  return run_threads(rules.blocks, worlds.count, at_once, threads,
                     kernel.scratch_bytes(rules.blocks),
                     [&](const WorldQueue& queue, AssemblyScratch& scratch) {
                       return kernel.run(run.view(), rules, worlds, out, queue, scratch);
                     });
}

std::int64_t assemble_batch(const PreparedRun<double>& run, const AssemblyRules& rules,
                            const AssemblyWorlds& worlds, int threads, const AssemblyOutputs& out) {
  return run_threads(rules.blocks, worlds.count, 1, threads, assembly_reference_bytes(rules.blocks),
                     [&](const WorldQueue& queue, AssemblyScratch& scratch) {
                       return assemble_reference(run.view(), rules, worlds, out, queue, scratch);
                     });
}

} // namespace driftwalk
