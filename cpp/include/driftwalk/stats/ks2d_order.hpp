// Sorting and merging for the KS statistic: from coordinates to positions. Not for lane sources.
#pragma once

#include "driftwalk/stats/ks2d.hpp"
#include "driftwalk/stats/ks2d_sweep.hpp"

#include <cstdint>
#include <vector>

namespace driftwalk {

// Scratch grows and never shrinks; what it held is lost.
template <class T>
void ks_grow(std::vector<T>& values, std::int64_t size) {
  if (std::int64_t(values.size()) < size) {
    values.resize(static_cast<std::size_t>(size));
  }
}

// A number and the point it came from; numbers are kept as integers in the same order.
struct KsSortedAxis {
  std::vector<std::uint64_t> key;
  std::vector<std::int32_t> index;
};

struct KsSortScratch {
  std::vector<std::uint64_t> key;
  std::vector<std::uint64_t> from;
  std::vector<std::uint64_t> to;
};

struct KsSortedSample {
  std::int64_t n = 0;
  KsSortedAxis x;
  KsSortedAxis y;
};

// The pooled points by position, see KsSweep.
struct KsGeometry {
  std::int64_t n = 0;
  std::int64_t tied = 0;                // points that share a coordinate with another
  std::vector<std::int32_t> point;      // by position in x: index, sample 2 after sample 1
  std::vector<std::int32_t> y_position; // by position in x
  std::vector<std::uint8_t> second;     // by position in x
  std::vector<std::uint8_t> x_starts;   // 1 where a new value of x begins, by position in x
  std::vector<std::uint8_t> y_starts;   // the same in the order of y
  // Scratch.
  std::vector<std::int32_t> y_point;
  std::vector<std::int32_t> position_of;
  std::vector<std::int32_t> start_of;
  std::vector<std::int32_t> next;
};

void ks_sort(const double* values, std::int64_t n, KsSortScratch& scratch, KsSortedAxis& axis);
void ks_sort(const double* x, const double* y, std::int64_t n, KsSortScratch& scratch,
             KsSortedSample& sample);
void ks_geometry(const KsSortedSample& first, const KsSortedSample& second, KsGeometry& geometry);

// The largest weight, by absolute value, over all cuts. `position` is the position in x of the last
// point with x <= X, `y_position` the same in y. `weight` and
// `total` as in KsSweep. See KsPeacock.
struct KsCut {
  std::int64_t value = 0;
  std::int64_t position = -1;
  std::int64_t y_position = -1;
  std::int32_t quadrant = -1;
};
KsCut ks_largest_cut(const KsGeometry& geometry, const std::int64_t weight[2], std::int64_t total);

// What shares a coordinate with each point, by position in x.
struct KsTiedWeights {
  std::vector<KsTied> tied;
  std::vector<std::int32_t> x_position; // by position in y
};

// `second` by position in x, `weight` as in KsSweep.
void ks_tied_weights(const KsGeometry& geometry, const std::uint8_t* second,
                     const std::int64_t weight[2], KsTiedWeights& weights);

} // namespace driftwalk
