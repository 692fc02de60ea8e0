// One lane of a pack in and out: a world's start, its scene for settle and back, its results.
#pragma once

#include "driftwalk/assembly/crowd.hpp"
#include "driftwalk/assembly/pull.hpp"
#include "driftwalk/random/philox.hpp"

DRIFTWALK_LANES_BEGIN

// The memory of a pack, laid out in one piece. A few blocks: a lane is a world, a row of lanes one
// block of each. Many: all lanes are blocks of one world, rows one after the other.
template <class Real>
struct PackMemory {
  static constexpr int lanes = Numbers<Real>::lanes;
  bool one_world;
  Member<Real>* members; // [row]
  Sums<Real>* sums;      // [row]
  Pulled<Real>* pulled;  // [row]
  BlockBook* books;      // [block][lane], of one world [block]
  Bond* bonds;           // [world][bond_room]
  Crowd<Real> crowd;     // of one world

  // Whether a pack with room for this many blocks holds one world.
  static constexpr bool is_one_world(int blocks) {
    return lanes == 1 || blocks > most_blocks_all_pairs;
  }
  static std::size_t bytes(int blocks) { return bytes_of(blocks, is_one_world(blocks)); }
  static std::size_t bytes_of(int blocks, bool one_world) {
    PackMemory layout;
    return layout.place(nullptr, blocks, one_world);
  }
  PackMemory() = default;
  PackMemory(void* memory, int blocks, bool holds_one_world) {
    place(static_cast<char*>(memory), blocks, holds_one_world);
  }

  int rows(int blocks) const { return one_world ? (blocks + lanes - 1) / lanes : blocks; }
  // The row and the lane of a block of a world.
  Member<Real>& member(int block) const { return members[one_world ? block / lanes : block]; }
  int lane(int block, int world) const { return one_world ? block % lanes : world; }
  BlockBook& book(int block, int lane) const {
    return books[one_world ? block : block * lanes + lane];
  }

private:
  std::size_t place(char* memory, int blocks, bool holds_one_world) {
    std::size_t size = 0;
    const auto take = [&](auto*& pointer, std::size_t count) {
      using Item = std::remove_reference_t<decltype(*pointer)>;
      pointer = memory == nullptr ? nullptr : reinterpret_cast<Item*>(memory + size);
      size = (size + count * sizeof(Item) + 63) / 64 * 64;
    };
    one_world = holds_one_world;
    const std::size_t count = static_cast<std::size_t>(rows(blocks));
    take(members, count);
    take(sums, count);
    take(pulled, count);
    take(books, count * lanes);
    take(bonds, static_cast<std::size_t>(bond_room(blocks)) * (one_world ? 1 : lanes));
    if (one_world) {
      crowd.place(take, count);
    }
    return size;
  }
};

// Of the faces of the block's assembly: a joined face neither pulls nor is pulled.
template <class Real>
inline void set_poles(const AssemblyRules& rules, const PackMemory<Real>& pack, int block,
                      int world) {
  const int lane = pack.lane(block, world);
  const BlockBook& book = pack.book(block, lane);
  for (int face = 0; face < 4; ++face) {
    const bool joined = (book.joined >> face & 1) != 0;
    const int own = (face - book.quarter) & 3;
    const double pole =
        rules.faces != nullptr ? rules.faces->pole[book.kind][own] : rules.pull.pole[own];
    put(pack.pulled[pack.one_world ? block / PackMemory<Real>::lanes : block].pole[face], lane,
        joined ? 0.0 : pole);
  }
}

template <class Real>
inline void put_before(Member<Real>& m, int lane) {
  put(m.before.x, lane, get(m.pose.x, lane));
  put(m.before.y, lane, get(m.pose.y, lane));
  put(m.before.theta, lane, get(m.pose.theta, lane));
  put(m.axes_before.cosine, lane, get(m.axes.cosine, lane));
  put(m.axes_before.sine, lane, get(m.axes.sine, lane));
}

// A block alone, at rest at a pose [x, y, theta].
template <class Real, class T>
inline void load_block(const AssemblyRules& rules, const double* pose, const PackMemory<Real>& pack,
                       int block, int world) {
  Member<Real>& m = pack.member(block);
  const int lane = pack.lane(block, world);
  put(m.pose.x, lane, pose[0]);
  put(m.pose.y, lane, pose[1]);
  put(m.pose.theta, lane, __builtin_remainder(pose[2], 2 * pi_value));
  put_rest(m.motion, lane);
  put_rest(m.drag, lane);
  const Axes<Real> axes = axes_at(m.pose.theta);
  put(m.axes.cosine, lane, get(axes.cosine, lane));
  put(m.axes.sine, lane, get(axes.sine, lane));
  put_before(m, lane);
  put(m.root, lane, block);
  put(m.per_count, lane, T(1));
  put(m.per_inertia, lane, rules.mass / rules.inertia);
  put(m.lightness, lane, T(1));
  put(m.offset_x, lane, T(0));
  put(m.offset_y, lane, T(0));
  put(m.arm.x, lane, T(0));
  put(m.arm.y, lane, T(0));
  put(m.turn.cosine, lane, T(1));
  put(m.turn.sine, lane, T(0));
  put(m.x, lane, pose[0]);
  put(m.y, lane, pose[1]);
  for (int face = 0; face < 4; ++face) {
    put(m.covered[face], lane, false);
  }
  for (Real& normal : m.normals) {
    put(normal, lane, T(0));
  }
  pack.book(block, lane) = {0, 0, 0, 0, first_kind(rules.faces, block)};
  set_poles(rules, pack, block, lane);
}

template <class Real, class T>
inline void load_lane(const AssemblyRules& rules, const double* start, const PackMemory<Real>& pack,
                      int world) {
  for (int b = 0; b < rules.blocks; ++b) {
    load_block<Real, T>(rules, start + 3 * b, pack, b, world);
  }
  // What fills the last row of one world repeats a block, and touches nothing.
  const int filled = pack.one_world ? pack.rows(rules.blocks) * PackMemory<Real>::lanes : 0;
  for (int b = rules.blocks; b < filled; ++b) {
    load_block<Real, T>(rules, start, pack, b, world);
  }
}

template <class Real>
inline void unit_axes(const Axes<Real>& axes, int lane, double& cosine, double& sine) {
  const double c = get(axes.cosine, lane), s = get(axes.sine, lane);
  const double length = __builtin_sqrt(c * c + s * s);
  cosine = c / length;
  sine = s / length;
}

// The lane's world in plain numbers.
template <class Real>
inline void fill_scene(const AssemblyRules& rules, const PackMemory<Real>& pack, int world,
                       int assemblies, Scene& scene) {
  scene.blocks = rules.blocks;
  scene.assemblies = assemblies;
  scene.contact = scene.rebuilt = false;
  for (int b = 0; b < rules.blocks; ++b) {
    const Member<Real>& m = pack.member(b);
    const int lane = pack.lane(b, world);
    const BlockBook& book = pack.book(b, lane);
    SceneBlock& block = scene.block[b];
    SceneAssembly& assembly = scene.assembly[b];
    block.assembly = get(m.root, lane);
    block.cell_x = book.cell_x;
    block.cell_y = book.cell_y;
    block.quarter = book.quarter;
    block.joined = book.joined;
    block.kind = book.kind;
    block.turn = book.turn;
    block.turn_cosine = book.turn_cosine;
    block.turn_sine = book.turn_sine;
    block.offset_x = get(m.offset_x, lane);
    block.offset_y = get(m.offset_y, lane);
    assembly.blocks = 0;
    assembly.touched = false;
    if (block.assembly == b) {
      assembly.moved = 0;
      assembly.x = get(m.pose.x, lane);
      assembly.y = get(m.pose.y, lane);
      assembly.theta = get(m.pose.theta, lane);
      unit_axes(m.axes, lane, assembly.cosine, assembly.sine);
      assembly.before.x = get(m.before.x, lane);
      assembly.before.y = get(m.before.y, lane);
      assembly.before.theta = get(m.before.theta, lane);
      unit_axes(m.axes_before, lane, assembly.before.cosine, assembly.before.sine);
      assembly.vx = get(m.motion.vx, lane);
      assembly.vy = get(m.motion.vy, lane);
      assembly.omega = get(m.motion.omega, lane);
      assembly.inertia = rules.inertia / get(m.lightness, lane);
    }
    SceneAssembly& body = scene.assembly[block.assembly];
    (body.blocks == 0 ? body.first : scene.block[body.last].next) = b;
    body.last = b;
    block.next = -1;
    ++body.blocks;
    block.x = body.x + (body.cosine * block.offset_x - body.sine * block.offset_y);
    block.y = body.y + (body.sine * block.offset_x + body.cosine * block.offset_y);
  }
}

template <class Real>
inline void cover_faces(const AssemblyRules& rules, const PackMemory<Real>& pack, int block,
                        int world) {
  const int lane = pack.lane(block, world);
  const unsigned joined = pack.book(block, lane).joined;
  for (int face = 0; face < 4; ++face) {
    put(pack.member(block).covered[face], lane,
        rules.hidden_share < 1 && (joined >> face & 1u) != 0);
  }
  set_poles(rules, pack, block, lane);
}

template <class Real>
inline void read_block(const AssemblyRules& rules, const Scene& scene, const PackMemory<Real>& pack,
                       int b, int world) {
  Member<Real>& m = pack.member(b);
  const int lane = pack.lane(b, world);
  const SceneBlock& block = scene.block[b];
  const SceneAssembly& body = scene.assembly[block.assembly];
  // What the scene rounds otherwise than the lanes, whether it has changed or not.
  put(m.axes.cosine, lane, body.cosine);
  put(m.axes.sine, lane, body.sine);
  put(m.per_inertia, lane, rules.mass * body.blocks / body.inertia);
  put(m.lightness, lane, rules.inertia / body.inertia);
  put(m.arm.x, lane, block.x - body.x);
  put(m.arm.y, lane, block.y - body.y);
  put(m.x, lane, block.x);
  put(m.y, lane, block.y);
  if (!body.touched && body.moved == 0) {
    return;
  }
  put(m.pose.x, lane, body.x);
  put(m.pose.y, lane, body.y);
  put(m.pose.theta, lane, body.theta);
  put(m.motion.vx, lane, body.vx);
  put(m.motion.vy, lane, body.vy);
  put(m.motion.omega, lane, body.omega);
  put(m.before.x, lane, body.before.x);
  put(m.before.y, lane, body.before.y);
  put(m.before.theta, lane, body.before.theta);
  put(m.axes_before.cosine, lane, body.before.cosine);
  put(m.axes_before.sine, lane, body.before.sine);
  if (body.touched) {
    put_rest(m.drag, lane);
  }
  put(m.root, lane, block.assembly);
  put(m.per_count, lane, 1.0 / body.blocks);
  put(m.offset_x, lane, block.offset_x);
  put(m.offset_y, lane, block.offset_y);
  put(m.turn.cosine, lane, block.turn_cosine);
  put(m.turn.sine, lane, block.turn_sine);
  pack.book(b, lane) = {static_cast<std::int16_t>(block.cell_x),
                        static_cast<std::int16_t>(block.cell_y),
                        static_cast<std::uint8_t>(block.quarter),
                        static_cast<std::uint8_t>(block.joined),
                        block.kind,
                        block.turn,
                        block.turn_cosine,
                        block.turn_sine};
  cover_faces(rules, pack, b, lane);
}

template <class Real>
inline void read_scene(const AssemblyRules& rules, const Scene& scene, const PackMemory<Real>& pack,
                       int world) {
  for (int b = 0; b < rules.blocks; ++b) {
    read_block(rules, scene, pack, b, world);
  }
}

// The block's own orientation [rad].
template <class Real, class T>
inline T own_angle(const PackMemory<Real>& pack, int block, int world) {
  const int lane = pack.lane(block, world);
  const T turned = get(pack.member(block).pose.theta, lane) +
                   T(pack.book(block, lane).quarter) * static_cast<T>(pi_value / 2) +
                   static_cast<T>(pack.book(block, lane).turn);
  const T turn = static_cast<T>(2 * pi_value), half = static_cast<T>(pi_value);
  return turned > half ? turned - turn : turned;
}

template <class Real, class T>
inline void read_blocks(const AssemblyRules& rules, const PackMemory<Real>& pack, int world,
                        const LiveBlocks& out) {
  for (int b = 0; b < rules.blocks; ++b) {
    const Member<Real>& m = pack.member(b);
    const int lane = pack.lane(b, world);
    const BlockBook& book = pack.book(b, lane);
    const T omega = get(m.motion.omega, lane);
    out.pose[3 * b] = get(m.x, lane);
    out.pose[3 * b + 1] = get(m.y, lane);
    out.pose[3 * b + 2] = own_angle<Real, T>(pack, b, lane);
    out.velocity[3 * b] = get(m.motion.vx, lane) - omega * get(m.arm.y, lane);
    out.velocity[3 * b + 1] = get(m.motion.vy, lane) + omega * get(m.arm.x, lane);
    out.velocity[3 * b + 2] = omega;
    out.assembly[b] = get(m.root, lane);
    out.cell[2 * b] = book.cell_x;
    out.cell[2 * b + 1] = book.cell_y;
    out.quarter[b] = book.quarter;
    out.kind[b] = book.kind;
  }
}

// Bits of `Status` of the world in a lane.
template <class Real, class T>
inline std::uint32_t lane_status(const Prepared<T>& run, const AssemblyRules& rules,
                                 const PackMemory<Real>& pack, int world) {
  bool finite = true, inside = true;
  for (int b = 0; b < rules.blocks; ++b) {
    const Member<Real>& m = pack.member(b);
    const int lane = pack.lane(b, world);
    const T x = get(m.x, lane), y = get(m.y, lane), theta = own_angle<Real, T>(pack, b, lane);
    const T speed = get(m.motion.vx, lane) + get(m.motion.vy, lane) + get(m.motion.omega, lane);
    finite = finite && abs(x + y + theta + speed) < T(1e30);
    inside = inside && x > run.flow.low_x - run.block.half_side &&
             x < run.flow.high_x + run.block.half_side &&
             y > run.flow.low_y - run.block.half_side && y < run.flow.high_y + run.block.half_side;
  }
  return (finite ? 0u : status_non_finite) | (inside ? 0u : status_escaped);
}

template <class Real, class T>
inline void write_results(const Prepared<T>& run, const AssemblyRules& rules,
                          const AssemblyOutputs& out, const PackMemory<Real>& pack, int own,
                          const LaneBook& book, std::int64_t steps) {
  const std::int64_t world = book.world;
  for (int b = 0; b < rules.blocks; ++b) {
    const Member<Real>& m = pack.member(b);
    const int lane = pack.lane(b, own);
    const std::int64_t row = world * rules.blocks + b;
    out.pose[3 * row] = get(m.x, lane);
    out.pose[3 * row + 1] = get(m.y, lane);
    out.pose[3 * row + 2] = own_angle<Real, T>(pack, b, lane);
    const BlockBook& block = pack.book(b, lane);
    out.cell[2 * row] = block.cell_x;
    out.cell[2 * row + 1] = block.cell_y;
    out.quarter[row] = block.quarter;
    out.assembly[row] = get(m.root, lane);
  }
  out.status[world] = lane_status<Real, T>(run, rules, pack, own);
  out.event_count[world] = book.event_count;
  out.first_contact_step[world] = book.first_contact;
  out.end_step[world] = static_cast<std::int32_t>(steps);
}

template <class Real, class T>
inline void write_moment(const AssemblyRules& rules, const AssemblyOutputs& out,
                         const PackMemory<Real>& pack, int own, std::int64_t world,
                         std::int64_t sample) {
  const std::int64_t first = (world * out.samples + sample) * rules.blocks;
  for (int b = 0; b < rules.blocks; ++b) {
    const Member<Real>& m = pack.member(b);
    const int lane = pack.lane(b, own);
    float* const pose = out.sample_pose + 3 * (first + b);
    pose[0] = static_cast<float>(get(m.x, lane));
    pose[1] = static_cast<float>(get(m.y, lane));
    pose[2] = static_cast<float>(own_angle<Real, T>(pack, b, lane));
    out.sample_assembly[first + b] = get(m.root, lane);
  }
}

DRIFTWALK_LANES_END
