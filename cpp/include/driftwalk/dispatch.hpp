// Which instruction set the kernels run on: the best that both the processor and this build have,
// or the one named in the environment variable DRIFTWALK_INSTRUCTION_SET (baseline, avx2, avx512).
#pragma once

namespace driftwalk {

enum class InstructionSet { baseline = 0, avx2 = 1, avx512 = 2 };

const char* name(InstructionSet set);

// Whether this build and this processor can run it.
bool is_available(InstructionSet set);

// Reads the environment at every call. Throws std::invalid_argument when it names a set that is
// unknown or not available here.
InstructionSet chosen_instruction_set();

// DRIFTWALK_CHOSEN(simulate_kernel_) calls that of simulate_kernel_baseline, simulate_kernel_avx2
// and simulate_kernel_avx512 whose set is chosen.
#if defined(DRIFTWALK_X86_LANES)
template <class Function>
auto call_chosen(Function baseline, Function avx2, Function avx512) {
  switch (chosen_instruction_set()) {
  case InstructionSet::avx512:
    return avx512();
  case InstructionSet::avx2:
    return avx2();
  case InstructionSet::baseline:
    break;
  }
  return baseline();
}
#define DRIFTWALK_CHOSEN(name) ::driftwalk::call_chosen(name##baseline, name##avx2, name##avx512)
#else
#define DRIFTWALK_CHOSEN(name) name##baseline()
#endif

} // namespace driftwalk
