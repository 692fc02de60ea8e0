// The self-assembly kernel in double precision, one world at a time: the reference of the others.
#include "driftwalk/assembly/run.hpp"
#include "driftwalk/physics/laws/mixed.hpp"

namespace driftwalk {

std::int64_t assemble_reference(const Prepared<double>& run, const AssemblyRules& rules,
                                const AssemblyWorlds& worlds, const AssemblyOutputs& out,
                                const WorldQueue& queue, AssemblyScratch& scratch) {
  const auto assembled = [&]<class Law>() {
    return AssemblyPack<double, double, Law>(run, rules, worlds, out, queue, scratch).run();
  };
  return !run.drag.is_quadratic ? assembled.template operator()<MixedDrag<double>>()
                                : assembled.template operator()<QuadraticDrag>();
}

std::size_t assembly_reference_bytes(int blocks) {
  return PackMemory<double>::bytes(blocks);
}

} // namespace driftwalk
