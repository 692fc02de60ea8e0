# clang for another system, as Zig brings it, for .ci/cross. DRIFTWALK_ZIG is the program, and
# DRIFTWALK_TARGET the system as Zig names it, such as aarch64-linux-gnu.2.28.
set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES DRIFTWALK_ZIG DRIFTWALK_TARGET)
string(REGEX MATCH "^([a-z0-9_]+)-([a-z]+)" matched "${DRIFTWALK_TARGET}")
set(CMAKE_SYSTEM_PROCESSOR "${CMAKE_MATCH_1}")
set(system_linux Linux)
set(system_macos Darwin)
set(system_windows Windows)
set(CMAKE_SYSTEM_NAME "${system_${CMAKE_MATCH_2}}")
set(CMAKE_CXX_COMPILER "${DRIFTWALK_ZIG}" c++ -target "${DRIFTWALK_TARGET}")
# The machine's own archiver does not know the objects of macOS.
set(CMAKE_CXX_ARCHIVE_CREATE "\"${DRIFTWALK_ZIG}\" ar qc <TARGET> <OBJECTS>")
set(CMAKE_CXX_ARCHIVE_FINISH "\"${DRIFTWALK_ZIG}\" ranlib <TARGET>")
# For the questions to the compiler too: Zig builds its C++ library once per level of optimisation.
set(CMAKE_CXX_FLAGS_INIT "-O3")
if(CMAKE_SYSTEM_NAME STREQUAL Darwin)
  set(CMAKE_USER_MAKE_RULES_OVERRIDE_CXX "${CMAKE_CURRENT_LIST_DIR}/zig-macos.cmake")
endif()
