# Said after CMake's own rules for macOS, by zig.cmake. Zig's linker does not take nanobind's list of the
# names that Python has, so in a module linked here any unknown name is left to Python.
set(CMAKE_CXX_CREATE_SHARED_MODULE
    "<CMAKE_CXX_COMPILER> -shared -undefined dynamic_lookup -o <TARGET> <OBJECTS> <LINK_LIBRARIES>")
