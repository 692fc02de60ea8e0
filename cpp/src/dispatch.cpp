#include "driftwalk/dispatch.hpp"

#include <cstdlib>
#include <stdexcept>
#include <string>

#if defined(DRIFTWALK_X86_LANES)
#include <cpuid.h>
#endif

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

namespace {

#if defined(DRIFTWALK_X86_LANES)
// Registers that the system saves when it switches threads.
unsigned saved_registers() {
  unsigned low = 0, high = 0;
  __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
  return low;
}

// By the processor's own words: __builtin_cpu_supports needs a part of the compiler's library that
// is missing where clang links with the libraries of Visual Studio.
InstructionSet ask_processor() {
  constexpr unsigned os_saves = 1u << 27, ymm = 0x6, zmm = 0xe6;
  constexpr unsigned avx2 = 1u << 5;
  constexpr unsigned avx512 = 1u << 16 | 1u << 17 | 1u << 30 | 1u << 31; // f, dq, bw, vl
  unsigned a = 0, b = 0, c = 0, d = 0;
  if (__get_cpuid(1, &a, &b, &c, &d) == 0 || (c & os_saves) == 0) {
    return InstructionSet::baseline;
  }
  const unsigned saved = saved_registers();
  if (__get_cpuid_count(7, 0, &a, &b, &c, &d) == 0 || (saved & ymm) != ymm || (b & avx2) == 0) {
    return InstructionSet::baseline;
  }
  const bool wide = (saved & zmm) == zmm && (b & avx512) == avx512;
  return wide ? InstructionSet::avx512 : InstructionSet::avx2;
}
#else
InstructionSet ask_processor() {
  return InstructionSet::baseline;
}
#endif

// Asked once: under a hypervisor the question takes long.
InstructionSet best_of_processor() {
  static const InstructionSet best = ask_processor();
  return best;
}

} // namespace

bool is_available(InstructionSet set) {
  return set <= best_of_processor();
}

InstructionSet chosen_instruction_set() {
  const char* const wanted = std::getenv("DRIFTWALK_INSTRUCTION_SET");
  if (wanted == nullptr || *wanted == '\0') {
    return best_of_processor();
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
