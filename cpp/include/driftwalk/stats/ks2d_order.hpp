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

// Numbers in order, kept as integers in the same order, and where each came from.
struct KsSortedAxis {
  std::vector<std::uint64_t> key;
  std::vector<std::int32_t> from;
  bool tied = false; // whether two of the numbers are equal
};

struct KsKeyedPlace {
  std::uint64_t key;
  std::int32_t from;
};

struct KsSortScratch {
  KsSortedAxis dealt;
  std::vector<std::uint32_t> leads;
  std::vector<std::uint32_t> order;
  std::vector<std::uint32_t> middle;
  std::vector<KsKeyedPlace> items;
  std::vector<double> y_by_x;
};

// A rank is a place in the order of one axis of one sample.
struct KsSortedSample {
  std::int64_t n = 0;
  KsSortedAxis x; // from: row of the sample
  KsSortedAxis y; // from: rank in x
};

// The pooled points by position, see KsSweep.
struct KsGeometry {
  std::int64_t n = 0;
  std::int64_t tied = 0;                // points that share a coordinate with another
  std::vector<std::int32_t> x_position; // by position in y
  std::vector<std::uint8_t> second_by_x;
  std::vector<std::uint8_t> second_by_y;
  std::vector<std::int32_t> point; // by position in x: row, sample 2 after sample 1; see ks_points
  // Where a new value begins, by position: 1, else 0. Filled where points are tied.
  std::vector<std::uint8_t> x_starts;
  std::vector<std::uint8_t> y_starts;
  // Scratch.
  std::vector<std::int32_t> position_of;
  std::vector<std::int32_t> position_by_y;
  std::vector<std::int32_t> start_of;
  std::vector<std::int32_t> next;
  std::vector<std::int32_t> ordered;

  bool starts_in_x(std::int64_t position) const { return tied == 0 || x_starts[position] != 0; }
  bool starts_in_y(std::int64_t position) const { return tied == 0 || y_starts[position] != 0; }
};

void ks_sort(const double* x, const double* y, std::int64_t n, KsSortScratch& scratch,
             KsSortedSample& sample);

// `point` is left for ks_points to fill, unless points are tied.
void ks_geometry(const KsSortedSample& first, const KsSortedSample& second, KsGeometry& geometry);
void ks_points(const KsSortedSample& first, const KsSortedSample& second, KsGeometry& geometry);
// The row, in its own sample, of the point at a position in x.
std::int64_t ks_row(const KsSortedSample& first, const KsSortedSample& second,
                    const KsGeometry& geometry, std::int64_t position);

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

// What shares a coordinate with each point.
struct KsTiedWeights {
  std::vector<KsTiedInX> in_x;
  std::vector<KsTiedInY> in_y;
  std::vector<std::int32_t> y_position; // by position in x
};

// `second_by_x` and `weight` as in KsSweep.
void ks_tied_weights(const KsGeometry& geometry, const std::uint8_t* second_by_x,
                     const std::int64_t weight[2], KsTiedWeights& weights);

} // namespace driftwalk
