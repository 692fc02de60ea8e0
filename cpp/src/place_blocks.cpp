// Random start poses of many blocks, one after the other (random sequential placement).
#include "driftwalk/assembly/assemble.hpp"
#include "driftwalk/assembly/settle_parts.hpp"
#include "driftwalk/math/elementary.hpp"
#include "driftwalk/random/philox.hpp"

#include <algorithm>
#include <cmath>

namespace driftwalk {

namespace {
constexpr UInt32 most_attempts = 20;
constexpr int most_draws = 5000;      // per block
constexpr int most_draws_later = 500; // for one that comes later, which may try again

Philox<UInt32> stream_of(std::uint64_t key) {
  return {static_cast<UInt32>(key), static_cast<UInt32>(key >> 32)};
}

struct Placed {
  Vec2 at, axis;
};

// Whether a point, or a disc about it, is within the wall.
bool is_within(const AssemblyRules& rules, Vec2 at, double radius) {
  const double inner = rules.radius - radius;
  if (rules.radius > 0 && (inner < 0 || dot(at, at) > inner * inner)) {
    return false;
  }
  for (int e = 0; e < rules.edge_count; ++e) {
    const PreparedEdge<double>& edge = rules.edges[e];
    if (at.x * edge.normal_x + at.y * edge.normal_y > edge.distance - radius) {
      return false;
    }
  }
  return true;
}

bool is_inside(const AssemblyRules& rules, const Placed& p) {
  if (rules.round) {
    return is_within(rules, p.at, rules.side / 2);
  }
  const Vec2 along = p.axis * (rules.side / 2);
  const Vec2 across = Vec2{-p.axis.y, p.axis.x} * (width_of(rules) / 2);
  for (const double sign_x : {-1.0, 1.0}) {
    for (const double sign_y : {-1.0, 1.0}) {
      if (!is_within(rules, p.at + along * sign_x + across * sign_y, 0)) {
        return false;
      }
    }
  }
  return true;
}

bool is_clear(const AssemblyRules& rules, const Placed& p, const double* start, int placed) {
  for (int b = 0; b < placed; ++b, start += 3) {
    const Vec2 between = Vec2{start[0], start[1]} - p.at;
    if (rules.round) {
      if (dot(between, between) <= rules.side * rules.side) {
        return false;
      }
      continue;
    }
    if (dot(between, between) < square_of_diagonal(rules) &&
        overlap_depth(rules, between, p.axis, {std::cos(start[2]), std::sin(start[2])}) >= 0) {
      return false;
    }
  }
  return true;
}

// Whether a block at its pose, and those that are glued to it, are inside and clear of earlier
// ones.
bool body_fits(const AssemblyRules& rules, int block, double* start) {
  double* const pose = start + 3 * block;
  const Vec2 axis{std::cos(pose[2]), std::sin(pose[2])};
  for (int k = 0; k < rules.glued; ++k) {
    if (k > 0) {
      const double x = rules.side * (rules.glued_cells[2 * k] - rules.glued_cells[0]);
      const double y = rules.side * (rules.glued_cells[2 * k + 1] - rules.glued_cells[1]);
      pose[3 * k] = pose[0] + axis.x * x - axis.y * y;
      pose[3 * k + 1] = pose[1] + axis.y * x + axis.x * y;
      pose[3 * k + 2] = pose[2];
    }
    const Placed placed{{pose[3 * k], pose[3 * k + 1]}, axis};
    if (!is_inside(rules, placed) || !is_clear(rules, placed, start, block)) {
      return false;
    }
  }
  return true;
}

// Word 0 of the address: attempt; 1: block; 2: draw.
bool place_one(const AssemblyRules& rules, const Philox<UInt32>& stream, UInt32 attempt, int draws,
               int block, double* start) {
  for (int draw = 0; draw < draws; ++draw) {
    UInt32 words[4];
    stream(attempt, static_cast<UInt32>(block), static_cast<UInt32>(draw),
           static_cast<UInt32>(Purpose::start), words);
    double* const pose = start + 3 * block;
    pose[0] = rules.low_x + words[0] * 0x1p-32 * (rules.high_x - rules.low_x);
    pose[1] = rules.low_y + words[1] * 0x1p-32 * (rules.high_y - rules.low_y);
    pose[2] = (words[2] * 0x1p-31 - 1.0) * pi_value;
    if (body_fits(rules, block, start)) {
      return true;
    }
  }
  return false;
}
} // namespace

bool place_one_more(const AssemblyRules& rules, std::uint64_t key, std::int64_t interval, int block,
                    double* start) {
  // Beyond the attempts of the start, so that no number is drawn twice.
  return place_one(rules, stream_of(key), static_cast<UInt32>(most_attempts + interval),
                   most_draws_later, block, start);
}

int place_blocks(const AssemblyRules& rules, std::uint64_t key, double* start) {
  const Philox<UInt32> stream = stream_of(key);
  int most = 0;
  for (UInt32 attempt = 0; attempt < most_attempts; ++attempt) {
    int block = 0;
    while (block < rules.blocks && place_one(rules, stream, attempt, most_draws, block, start)) {
      block += rules.glued;
    }
    most = std::max(most, block);
    if (most == rules.blocks) {
      break;
    }
  }
  return most;
}

} // namespace driftwalk
