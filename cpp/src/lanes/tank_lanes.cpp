// The kernel of worlds that keep their state, compiled once per instruction set.
#include "driftwalk/assembly/tank_group.hpp"
#include "driftwalk/physics/laws/mixed.hpp"

void driftwalk::DRIFTWALK_PER_ISA(go_on_)(const Prepared<float>& run, const AssemblyRules& rules,
                                          const TankGroup& group, AssemblyScratch& scratch) {
  run_group<FloatPack<assembly_lanes>>(run, rules, group, scratch);
}
