// The sweep of the KS statistic: plain data passed to the kernels of the instruction sets.
//
// Positions. Every pooled point has a position 0 .. n-1 in the order of x and one in the order of
// y. Points with equal x are ordered by descending y, points with equal y by descending position in
// x (see ks_geometry). Then "before it in both orders" is exactly "smaller in both coordinates",
// ties or not, and the sweep only counts along a permutation.
#pragma once

#include <cstdint>

namespace driftwalk {

// Weights that a point needs when it may share a coordinate with another, by position in x ...
struct KsTiedInX {
  std::int64_t column;      // weight of {x = X, y < Y}
  std::int64_t equal;       // weight of {x = X, y = Y}, the origin among them
  std::int64_t left;        // weight of {x < X}
  std::int64_t left_closed; // weight of {x <= X}
};
// ... and by position in y.
struct KsTiedInY {
  std::int64_t row;   // weight of {y = Y, x < X}
  std::int64_t below; // weight of {y < Y}
  std::int64_t below_closed;
};

struct KsSweep {
  std::int64_t n;                  // points of both samples
  const std::int32_t* x_position;  // (n) by position in y
  const std::uint8_t* second_by_x; // (n) by position in x: 1 for a point of sample 2
  const std::uint8_t* second_by_y; // (n) the same by position in y
  std::int64_t weight[2];          // of a point of sample 1 (positive) and of sample 2 (negative)
  std::int64_t total;              // sum of the positive weights
  const KsTiedInX* tied_in_x;      // (n), or null when no two points share a coordinate
  const KsTiedInY* tied_in_y;      // (n), or null with it
  bool limits;                     // count both open and closed quadrants
  void* scratch;                   // ks_scratch_bytes(n), aligned to 64
};

// The largest |weight| found with an origin of one sample, and where: position in x and quadrant.
// Of equal ones the first in the order of x, then of the quadrants.
struct KsBest {
  std::int64_t value;
  std::int64_t position; // -1 when the value is zero
  std::int32_t quadrant;
};

std::int64_t ks_scratch_bytes(std::int64_t n);

void ks_sweep_baseline(const KsSweep& sweep, KsBest best[2]);
void ks_sweep_avx2(const KsSweep& sweep, KsBest best[2]);
void ks_sweep_avx512(const KsSweep& sweep, KsBest best[2]);

// Sizes of the buckets of an axis. They come with the samples: a function of all instruction sets
// must not be compiled for one.
struct KsBucketSizes {
  std::int64_t points;    // that a bucket should hold: more make wide bounds, fewer many buckets
  std::int64_t bins;      // that an axis is dealt to: some to each bucket
  std::int64_t most_bins; // once crowded ones are split
  std::int64_t most;      // buckets
};

constexpr KsBucketSizes ks_bucket_sizes(std::int64_t n) {
  std::int64_t points = 8;
  while (64 * points * points < n) {
    points += points / 8;
  }
  std::int64_t bins = 128;
  while (bins * points < 4 * n && bins < 1 << 15) {
    bins *= 2;
  }
  return {points, bins, 9 * bins / 4 < 1 << 16 ? 9 * bins / 4 : 1 << 16,
          11 * n / (4 * points) + 64};
}

// The same statistic without an order, of two samples as they come; see KsBounded.
struct KsPlain {
  const double* x[2];
  const double* y[2];
  std::int64_t n[2];
  std::int64_t weight[2]; // as in KsSweep
  std::int64_t total;
  KsBucketSizes buckets;  // ks_bucket_sizes(n[0] + n[1])
  std::int64_t most_tied; // counting ends beyond so many tied points; with 0 none are counted
  void* scratch;          // ks_bounded_bytes(n[0] + n[1]), aligned to 64
};

// The largest |weight| with an origin of one sample, the row of that origin and the quadrant.
struct KsFound {
  std::int64_t value;
  std::int64_t row; // -1 when the value is zero
  std::int32_t quadrant;
};

// Points of both samples; with fewer the sweep takes no longer.
constexpr std::int64_t ks_bounded_from = 1024;
constexpr std::int64_t ks_bounded_to = std::int64_t(1) << 23;

constexpr std::int64_t ks_bounded_bytes(std::int64_t n) {
  const KsBucketSizes buckets = ks_bucket_sizes(n);
  return 80 * n + 92 * buckets.most_bins + 96 * buckets.most + 16 * 1024;
}

// False, with nothing found, where the bounds do not pay; the sweep has to be run.
bool ks_bounded_baseline(const KsPlain& samples, KsFound found[2], std::int64_t& tied);
bool ks_bounded_avx2(const KsPlain& samples, KsFound found[2], std::int64_t& tied);
bool ks_bounded_avx512(const KsPlain& samples, KsFound found[2], std::int64_t& tied);

} // namespace driftwalk
