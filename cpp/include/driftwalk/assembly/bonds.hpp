// Bonds between neighbours of an assembly, and what is left of those that broke.
//
// Read by code of every instruction set (see config.hpp): plain data, and no function but those
// that each set has of its own.
#pragma once

#include "driftwalk/config.hpp"

#include <cstdint>

namespace driftwalk {

// An open bond is broken while a loop still holds its blocks together. A parted one is broken, and
// its blocks, of two assemblies, are not clear of each other yet.
enum class BondState : std::uint8_t { whole, open, parted };

struct Bond {
  std::int16_t first, second; // blocks, first < second
  BondState state;
  double left; // hazard until it breaks, drawn from the exponential law of mean 1
};

// In the order of the blocks.
struct BondList {
  Bond* bond = nullptr;
  int count = 0;
  int room = 0;
};

// What an event of a world is, as written into `event_kind`.
enum class EventKind : std::int32_t {
  joining = 0, // two assemblies became one
  parting = 1, // one became two
  opening = 2, // a bond of a loop broke, and the loop holds its blocks together
  closing = 3, // of neighbours that a joining has brought together: a bond of a loop
};

} // namespace driftwalk

DRIFTWALK_LANES_BEGIN

// Room for all bonds, three a disc at most, and the parted pairs of a clearance of two diameters.
// Beyond it the oldest parted pair counts as clear.
inline constexpr int bond_room(int blocks) {
  return 16 * blocks;
}

DRIFTWALK_LANES_END
