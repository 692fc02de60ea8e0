// Batches of worlds with several blocks.
#pragma once

#include "driftwalk/assembly/rules.hpp"
#include "driftwalk/simulate/prepare.hpp"

namespace driftwalk {

// Runs all worlds; returns the number of block-steps. A world's rows depend on its inputs alone.
std::int64_t assemble_batch(const PreparedRun<float>& run, const AssemblyRules& rules,
                            const AssemblyWorlds& worlds, int threads, const AssemblyOutputs& out);
std::int64_t assemble_batch(const PreparedRun<double>& run, const AssemblyRules& rules,
                            const AssemblyWorlds& worlds, int threads, const AssemblyOutputs& out);

// Random start poses of one world that neither overlap nor cross the wall, [block][x, y, theta].
// Returns the number of blocks placed: rules.blocks, or the most that any attempt reached.
int place_blocks(const AssemblyRules& rules, std::uint64_t key, double* start);
// A random pose of one more block among those before it, for a world that has come to a force
// interval; false when none was found.
bool place_one_more(const AssemblyRules& rules, std::uint64_t key, std::int64_t interval, int block,
                    double* start);

} // namespace driftwalk
