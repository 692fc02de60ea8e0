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

} // namespace driftwalk
