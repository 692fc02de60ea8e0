// Points of two samples that share a coordinate with another, counted without an order on one
// instruction set. Equal numbers lie in the same bucket of their axis.
#pragma once

#include "driftwalk/config.hpp"
#include "driftwalk/stats/ks2d_buckets.hpp"
#include "driftwalk/stats/ks2d_kernel.hpp"
#include "driftwalk/stats/ks2d_sweep.hpp"

#include <cstdint>

DRIFTWALK_LANES_BEGIN

// A point in the order of one axis, in 64 bits: the less is written all over memory the better.
class KsRecord {
public:
  KsRecord(std::uint32_t point, std::uint16_t bucket, double value)
      : bits_(point | std::uint64_t(bucket) << point_bits |
              std::uint64_t(hash_of(value)) << hash_at) {}
  std::int32_t point() const { return std::int32_t(bits_ & ((1u << point_bits) - 1)); }
  // Of the other axis.
  std::int32_t bucket() const { return std::int32_t(bits_ >> point_bits & 0xFFFF); }
  // Equal for equal values.
  std::uint32_t hash() const { return std::uint32_t(bits_ >> hash_at); }
  // The point's number among those of sample 1, which has n1 points, and of sample 2.
  double value(const double* const values[2], std::int64_t n1) const { return *place(values, n1); }
  const double* place(const double* const values[2], std::int64_t n1) const {
    const std::int64_t i = point();
    return i < n1 ? values[0] + i : values[1] + (i - n1);
  }

  static constexpr int hash_bits = 25;

private:
  static constexpr int point_bits = 23;
  static constexpr int hash_at = 64 - hash_bits;
  static_assert((std::int64_t(1) << point_bits) >= ks_bounded_to);

  static std::uint32_t hash_of(double value) {
    const std::uint64_t bits = ks_bits(value);
    return std::uint32_t(((bits ^ bits >> 32) & 0xFFFFFFFF) * 0x9E3779B1u) >> (32 - hash_bits);
  }
  std::uint64_t bits_;
};

// An axis with its points in the order of its buckets.
struct KsBucketed {
  KsBuckets buckets;
  const KsRecord* records;
};

class KsTiedCounter {
public:
  // `tied`: by point, all zero.
  KsTiedCounter(const KsPlain& samples, const KsBucketed& columns, const KsBucketed& rows,
                std::uint8_t* tied, char* scratch)
      : samples_(samples), tied_(tied),
        before_(ks_take<std::int32_t>(scratch, samples.n[0] + samples.n[1])),
        met_(ks_take<std::int32_t>(scratch, samples.n[0] + samples.n[1])) {
    mark(columns, samples.x);
    mark(rows, samples.y);
  }

  // All, or more than the most that are counted.
  std::int64_t count() const { return found_; }

private:
  // Every point is compared with those before it in its bucket whose hashes begin with the same
  // bits, from the last back to the first that is equal.
  void mark(const KsBucketed& axis, const double* const values[2]) {
    constexpr int table_bits = 12;
    constexpr int shift = KsRecord::hash_bits - table_bits;
    std::int32_t last[1 << table_bits];
    for (std::int32_t& place : last) {
      place = -1;
    }
    const KsBuckets& buckets = axis.buckets;
    const KsRecord* const records = axis.records;
    std::int32_t* const before = before_;
    const std::int64_t n1 = samples_.n[0];
    std::int32_t count = 0;
    std::uint8_t* const tied = tied_;
    std::int64_t found = found_;
    const auto tie = [tied, &found](std::int32_t point) {
      found += tied[point] == 0;
      tied[point] = 1;
    };
    for (std::int64_t b = 0; b < buckets.count && found <= samples_.most_tied; ++b) {
      const std::int32_t begin = buckets.begin[b];
      const std::int32_t end = buckets.begin[b + 1];
      if (buckets.is_value[b] != 0) {
        for (std::int32_t k = begin; k < end; ++k) {
          tie(records[k].point());
        }
        continue;
      }
      // Where many met another, the numbers of the next bucket will be asked for: they lie far
      // apart.
      if (2 * count > end - begin && b + 1 < buckets.count && buckets.is_value[b + 1] == 0) {
        for (std::int32_t k = end; k < buckets.begin[b + 2]; ++k) {
          __builtin_prefetch(records[k].place(values, n1));
        }
      }
      // Points that met another, without a branch: in samples with ties no one foretells which do.
      count = 0;
      for (std::int32_t k = begin; k < end; ++k) {
        std::int32_t& place = last[records[k].hash() >> shift];
        const std::int32_t other = place;
        before[k] = other;
        place = k;
        met_[count] = k;
        count += other >= begin;
      }
      for (std::int32_t m = 0; m < count; ++m) {
        const std::int32_t k = met_[m];
        const KsRecord own = records[k];
        for (std::int32_t other = before[k]; other >= begin; other = before[other]) {
          const KsRecord met = records[other];
          if (own.hash() == met.hash() && own.value(values, n1) == met.value(values, n1)) {
            tie(own.point());
            tie(met.point());
            break;
          }
        }
      }
    }
    found_ = found;
  }

  const KsPlain& samples_;
  std::uint8_t* tied_;   // by point
  std::int32_t* before_; // by place in a bucket
  std::int32_t* met_;    // such places
  std::int64_t found_ = 0;
};

DRIFTWALK_LANES_END
