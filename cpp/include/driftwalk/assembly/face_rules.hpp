// Typed faces: which face latches with which, on blocks of several kinds, and the kind that a block
// becomes when a face of it has latched: a graph grammar (Klavins, Ghrist & Lipsky 2006).
//
// Read by code of every instruction set (see config.hpp): plain data, and no function but those
// that each set has of its own.
#pragma once

#include "driftwalk/config.hpp"

#include <cstdint>

namespace driftwalk {

// A type is a bit of a mask.
inline constexpr int most_face_types = 32, most_kinds = 32;

struct FaceRules {
  int kinds = 0;
  // Block b is of the first kind k with b % ends[kinds - 1] < ends[k] at the start.
  std::int32_t ends[most_kinds] = {};
  std::uint8_t type[most_kinds][4] = {}; // of the faces +x, +y, -x, -y in the block's own frame
  std::int8_t pole[most_kinds][4] = {};  // of a fixed magnet there: +1 N, -1 S, 0 none
  std::uint32_t latches[most_face_types] = {}; // bit t: latches with faces of type t
  // The kind that a block is after a face of it has latched with one of a type.
  std::uint8_t becomes[most_kinds][4][most_face_types] = {};
};

} // namespace driftwalk

DRIFTWALK_LANES_BEGIN

// The kind of a block at the start; 0 where faces have no types.
inline std::uint8_t first_kind(const FaceRules* faces, int block) {
  int kind = 0;
  if (faces != nullptr) {
    const int place = block % faces->ends[faces->kinds - 1];
    while (place >= faces->ends[kind]) {
      ++kind;
    }
  }
  return static_cast<std::uint8_t>(kind);
}

DRIFTWALK_LANES_END
