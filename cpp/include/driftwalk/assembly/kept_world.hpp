// A world that is kept while no pack holds it: its lane's numbers as they are, so that it goes on
// with the same bits in any lane.
#pragma once

#include "driftwalk/assembly/lane.hpp"

DRIFTWALK_LANES_BEGIN

// Where what is kept of a world begins, in bytes.
template <class Real>
struct KeptLayout {
  static constexpr std::size_t word = sizeof(typename Numbers<Real>::Scalar);
  static constexpr std::size_t words = sizeof(Member<Real>) / word / Numbers<Real>::lanes;
  static_assert(Numbers<Real>::lanes == 1 ||
                words * word * Numbers<Real>::lanes == sizeof(Member<Real>));
  std::size_t books, bonds, members, member, size;

  // `rows` of a world; where it has its pack alone, whole rows of lanes.
  KeptLayout(int blocks, int rows, bool one_world)
      : books(sizeof(LaneBook)),
        bonds(books + static_cast<std::size_t>(blocks) * sizeof(BlockBook)),
        members(bonds + static_cast<std::size_t>(bond_room(blocks)) * sizeof(Bond)),
        member(one_world ? sizeof(Member<Real>) : words * word),
        size(members + static_cast<std::size_t>(rows) * member) {}

  static std::size_t bytes(int blocks) {
    PackMemory<Real> pack;
    pack.one_world = PackMemory<Real>::is_one_world(blocks);
    return KeptLayout(blocks, pack.rows(blocks), pack.one_world).size;
  }
};

// One lane's words of a member: all its numbers are packs of words as wide as the scalar.
template <class Real>
inline void copy_lane(const Member<Real>& m, int lane, char* to) {
  constexpr std::size_t word = KeptLayout<Real>::word;
  const char* const from = reinterpret_cast<const char*>(&m) + word * lane;
  for (std::size_t k = 0; k < KeptLayout<Real>::words; ++k) {
    std::memcpy(to + word * k, from + word * Numbers<Real>::lanes * k, word);
  }
}
template <class Real>
inline void copy_lane(const char* from, int lane, Member<Real>& m) {
  constexpr std::size_t word = KeptLayout<Real>::word;
  char* const to = reinterpret_cast<char*>(&m) + word * lane;
  for (std::size_t k = 0; k < KeptLayout<Real>::words; ++k) {
    std::memcpy(to + word * Numbers<Real>::lanes * k, from + word * k, word);
  }
}

template <class Real>
inline void keep_world(const AssemblyRules& rules, const PackMemory<Real>& pack, int own,
                       const LaneBook& book, char* state) {
  const int rows = pack.rows(rules.blocks);
  const KeptLayout<Real> layout(rules.blocks, rows, pack.one_world);
  std::memcpy(state, &book, sizeof book);
  for (int b = 0; b < rules.blocks; ++b) {
    std::memcpy(state + layout.books + sizeof(BlockBook) * b, &pack.book(b, pack.lane(b, own)),
                sizeof(BlockBook));
  }
  std::memcpy(state + layout.bonds, book.bonds.bond, sizeof(Bond) * book.bonds.count);
  for (int row = 0; row < rows; ++row) {
    char* const to = state + layout.members + layout.member * row;
    if (pack.one_world) {
      std::memcpy(to, reinterpret_cast<const char*>(pack.members + row), layout.member);
    } else {
      copy_lane(pack.members[row], own, to);
    }
  }
}

template <class Real>
inline void resume_world(const AssemblyRules& rules, const PackMemory<Real>& pack, int own,
                         LaneBook& book, const char* state) {
  const int rows = pack.rows(rules.blocks);
  const KeptLayout<Real> layout(rules.blocks, rows, pack.one_world);
  LaneBook kept;
  std::memcpy(&kept, state, sizeof kept);
  book.first_contact = kept.first_contact;
  book.assemblies = kept.assemblies;
  book.bonds.count = kept.bonds.count;
  std::memcpy(book.bonds.bond, state + layout.bonds, sizeof(Bond) * book.bonds.count);
  for (int row = 0; row < rows; ++row) {
    const char* const from = state + layout.members + layout.member * row;
    if (pack.one_world) {
      std::memcpy(reinterpret_cast<char*>(pack.members + row), from, layout.member);
    } else {
      copy_lane(from, own, pack.members[row]);
    }
  }
  for (int b = 0; b < rules.blocks; ++b) {
    std::memcpy(&pack.book(b, pack.lane(b, own)), state + layout.books + sizeof(BlockBook) * b,
                sizeof(BlockBook));
    set_poles(rules, pack, b, own);
  }
}

DRIFTWALK_LANES_END
