#include "driftwalk/dispatch.hpp"

#include <cstdlib>
#include <stdexcept>
#include <string>

namespace driftwalk {

const char* name(InstructionSet set) {
  switch (set) {
  case InstructionSet::avx512:
    return "avx512";
  case InstructionSet::avx2:
    return "avx2";
  case InstructionSet::baseline:
    break;
  }
  return "baseline";
}

bool is_available(InstructionSet set) {
  switch (set) {
  case InstructionSet::avx512:
#if defined(DRIFTWALK_X86_LANES)
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
           __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
#else
    return false;
#endif
  case InstructionSet::avx2:
#if defined(DRIFTWALK_X86_LANES)
    return __builtin_cpu_supports("avx2");
#else
    return false;
#endif
  case InstructionSet::baseline:
    break;
  }
  return true;
}

namespace {
InstructionSet best_available() {
  for (const InstructionSet set : {InstructionSet::avx512, InstructionSet::avx2}) {
    if (is_available(set)) {
      return set;
    }
  }
  return InstructionSet::baseline;
}
} // namespace

InstructionSet chosen_instruction_set() {
  const char* const wanted = std::getenv("DRIFTWALK_INSTRUCTION_SET");
  if (wanted == nullptr || *wanted == '\0') {
    return best_available();
  }
  for (const InstructionSet set :
       {InstructionSet::baseline, InstructionSet::avx2, InstructionSet::avx512}) {
    if (std::string(wanted) == name(set)) {
      if (!is_available(set)) {
        throw std::invalid_argument(std::string("DRIFTWALK_INSTRUCTION_SET=") + wanted +
                                    " is not available on this machine");
      }
      return set;
    }
  }
  throw std::invalid_argument(std::string("DRIFTWALK_INSTRUCTION_SET=") + wanted +
                              " is unknown: use baseline, avx2 or avx512");
}

} // namespace driftwalk
