// The memory that one thread needs for its worlds.
#pragma once

#include "driftwalk/assembly/kernel.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <vector>

namespace driftwalk {

// Room for `blocks` blocks a world; `lane_bytes` is what the kernel asks for.
class AssemblyMemory {
public:
  AssemblyMemory(int blocks, std::size_t lane_bytes)
      : blocks_(static_cast<std::size_t>(blocks)), before_(blocks_.size()),
        assemblies_(blocks_.size()), next_(blocks_.size()), by_cell_(blocks_.size()),
        heads_(cell_heads),
        pairs_(static_cast<std::size_t>(std::min(pair_capacity(blocks), pairs_per_block * blocks))),
        close_(pairs_.size()),
        lanes_(static_cast<char*>(::operator new(lane_bytes, lane_alignment))) {
    scratch_.lanes = lanes_.get();
    Scene& scene = scratch_.scene;
    scene = {};
    scene.block = blocks_.data();
    scene.blocks_before = before_.data();
    scene.assembly = assemblies_.data();
    scene.pairs = list_in(pairs_);
    scene.close = list_in(close_);
    scene.cell_head = heads_.data();
    scene.cell_next = next_.data();
    scene.by_cell = by_cell_.data();
  }
  // The scene knows where its pairs are.
  AssemblyMemory(const AssemblyMemory&) = delete;
  AssemblyMemory& operator=(const AssemblyMemory&) = delete;
  AssemblyScratch& scratch() { return scratch_; }

private:
  // About twice what squares side by side have of a list: the room that a world begins with.
  static constexpr int pairs_per_block = 16;
  static PairList list_in(std::vector<BlockPair>& pairs) {
    return {pairs.data(), 0, static_cast<int>(pairs.size()), grow_pairs, &pairs};
  }
  static BlockPair* grow_pairs(void* owner, int room) {
    auto& pairs = *static_cast<std::vector<BlockPair>*>(owner);
    pairs.resize(static_cast<std::size_t>(room));
    return pairs.data();
  }
  // Of the widest registers. Windows has no std::aligned_alloc.
  static constexpr std::align_val_t lane_alignment{64};
  struct DeleteLanes {
    void operator()(char* lanes) const { ::operator delete(lanes, lane_alignment); }
  };

  std::vector<SceneBlock> blocks_, before_;
  std::vector<SceneAssembly> assemblies_;
  std::vector<std::int32_t> next_;
  std::vector<PlacedBlock> by_cell_;
  std::vector<std::int32_t> heads_;
  std::vector<BlockPair> pairs_, close_;
  std::unique_ptr<char, DeleteLanes> lanes_;
  AssemblyScratch scratch_;
};

} // namespace driftwalk
