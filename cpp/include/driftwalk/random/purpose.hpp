// What each stream of random numbers is for. The number is part of a random number's address:
// changing one changes every result, so new purposes are added at the end and none is reused.
#pragma once

#include <cstdint>

namespace driftwalk {

enum class Purpose : std::uint32_t {
  force = 1,       // stochastic force, one draw per force interval
  observation = 2, // camera noise, one draw per sample
  start = 3,       // start pose
  motion = 4,      // noise of a self-propelled particle, one draw per step
  bout = 5,        // its bouts, at the step in which one begins
  flow = 6,        // moment of a flow in frames at which a world begins
  torque = 7,      // of the stochastic force, one draw per force interval
  stirring = 8,    // force field at a node of its lattice, one draw per two force intervals
  bond = 9,        // hazard of a bond, at the step in which it forms
};

} // namespace driftwalk
