#include "driftwalk/assembly/settle_parts.hpp"

namespace driftwalk {

void settle(const AssemblyRules& rules, Scene& scene) {
  latch(rules, scene);
  if (scene.assemblies > 1) {
    bounce(rules, scene);
    separate(rules, scene);
  }
}

} // namespace driftwalk
