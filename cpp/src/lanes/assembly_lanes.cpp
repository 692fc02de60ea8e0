// The self-assembly kernel, compiled once per instruction set.
#include "driftwalk/assembly/run.hpp"
#include "driftwalk/physics/laws/mixed.hpp"

DRIFTWALK_LANES_BEGIN

namespace {
using Real = FloatPack<assembly_lanes>;

std::int64_t assemble(const Prepared<float>& run, const AssemblyRules& rules,
                      const AssemblyWorlds& worlds, const AssemblyOutputs& out,
                      const WorldQueue& queue, AssemblyScratch& scratch) {
  const auto assembled = [&]<class Law>() {
    if (PackMemory<Real>::is_one_world(rules.blocks)) {
      return AssemblyPack<Real, float, Law, true>(run, rules, worlds, out, queue, scratch).run();
    }
    return AssemblyPack<Real, float, Law>(run, rules, worlds, out, queue, scratch).run();
  };
  return !run.drag.is_quadratic ? assembled.template operator()<MixedDrag<Real>>()
                                : assembled.template operator()<QuadraticDrag>();
}

constexpr AssemblyKernel kernel{assemble, assembly_lanes, PackMemory<Real>::bytes};
} // namespace

DRIFTWALK_LANES_END

driftwalk::AssemblyKernel driftwalk::DRIFTWALK_PER_ISA(assembly_kernel_)() {
  return kernel;
}
