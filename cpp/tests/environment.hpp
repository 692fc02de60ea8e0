// The environment variable that names an instruction set, on every system.
#pragma once

#include <cstdlib>

namespace environment {

// An empty name leaves the choice to the machine.
inline void choose_instruction_set(const char* name) {
#if defined(_WIN32)
  _putenv_s("DRIFTWALK_INSTRUCTION_SET", name);
#else
  setenv("DRIFTWALK_INSTRUCTION_SET", name, 1);
#endif
}

} // namespace environment
