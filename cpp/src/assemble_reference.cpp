// The self-assembly kernel in double precision, one world at a time: the reference of the others.
#include "driftwalk/assembly/run.hpp"
#include "driftwalk/physics/laws/quadratic.hpp"

namespace driftwalk {

std::int64_t assemble_reference(const Prepared<double>& run, const AssemblyRules& rules,
                                const AssemblyWorlds& worlds, const AssemblyOutputs& out,
                                const WorldQueue& queue, AssemblyScratch& scratch) {
  return AssemblyPack<double, double, QuadraticDrag>({}, run, rules, worlds, out, queue, scratch,
                                                     scratch.blended_flow_twice)
      .run();
}

std::size_t assembly_reference_bytes(int blocks) {
  return PackMemory<double>::bytes(blocks);
}

} // namespace driftwalk
