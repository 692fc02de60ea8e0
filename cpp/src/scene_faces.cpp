// Typed faces: who latches with whom, which merges poles refuse, and what blocks become.
#include "driftwalk/assembly/settle_parts.hpp"

#include <cstdlib>

namespace driftwalk {

namespace {
int own_face(const SceneBlock& block, int face) {
  return (face - block.quarter) & 3;
}

// The face of a block towards a neighbour's cell, in the frame of their assembly; -1 of no
// neighbours.
int face_towards(const SceneBlock& block, const SceneBlock& other) {
  const int dx = other.cell_x - block.cell_x, dy = other.cell_y - block.cell_y;
  if (std::abs(dx) + std::abs(dy) != 1) {
    return -1;
  }
  return dx != 0 ? 1 - dx : 2 - dy;
}
} // namespace

bool types_latch(const FaceRules& faces, const SceneBlock& block, int face, const SceneBlock& other,
                 int peer) {
  const int own = faces.type[block.kind][own_face(block, face)];
  const int their = faces.type[other.kind][own_face(other, peer)];
  return (faces.latches[own] >> their & 1u) != 0;
}

bool poles_refuse(const FaceRules& faces, const Scene& scene, int stayed, int moved) {
  int like = 0, latching = 0;
  for (int b = moved; b >= 0; b = scene.blocks_before[b].next) {
    for (int c = stayed; c >= 0; c = scene.blocks_before[c].next) {
      const SceneBlock &block = scene.block[b], &other = scene.block[c];
      const int face = face_towards(block, other);
      if (face >= 0) {
        const int pole = faces.pole[block.kind][own_face(block, face)];
        const int their = faces.pole[other.kind][own_face(other, face + 2)];
        like += pole * their > 0;
        latching += types_latch(faces, block, face, other, face + 2);
      }
    }
  }
  return like > 0 && like >= latching;
}

void become(const FaceRules& faces, SceneBlock& block, int face, SceneBlock& other, int peer) {
  const int own = faces.type[block.kind][face], their = faces.type[other.kind][peer];
  block.kind = faces.becomes[block.kind][face][their];
  other.kind = faces.becomes[other.kind][peer][own];
}

} // namespace driftwalk
