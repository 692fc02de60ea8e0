// Points of two samples that share a coordinate with another, counted without an order on one
// instruction set. Equal numbers lie in the same bucket of their axis.
#pragma once

#include "driftwalk/config.hpp"
#include "driftwalk/stats/ks2d_buckets.hpp"
#include "driftwalk/stats/ks2d_kernel.hpp"
#include "driftwalk/stats/ks2d_sweep.hpp"

#include <cstdint>

DRIFTWALK_LANES_BEGIN

// Equal for equal numbers: -0.0 + 0.0 is +0.0.
inline std::uint64_t ks_bits(double value) {
  const double one_zero = value + 0.0;
  std::uint64_t bits;
  __builtin_memcpy(&bits, &one_zero, sizeof bits);
  return bits;
}

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
  double value(const double* const values[2], std::int64_t n1) const {
    const std::int64_t i = point();
    return i < n1 ? values[0][i] : values[1][i - n1];
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
  KsTiedCounter(const KsPlain& samples, const KsBucketed& columns, const KsBucketed& rows,
                char* scratch)
      : samples_(samples), columns_(columns), rows_(rows), n_(samples.n[0] + samples.n[1]),
        tied_(ks_take<std::uint8_t>(scratch, n_)), tied_in_x_(ks_take<std::uint8_t>(scratch, n_)),
        rest_(ks_take<std::uint16_t>(scratch, n_)) {}

  std::int64_t count() {
    std::int64_t count = 0;
    bool is_x_known = false;
    bool any_in_x = false;
    for (std::int64_t r = 0; r < rows_.buckets.count; ++r) {
      const std::int64_t begin = rows_.buckets.begin[r];
      const std::int64_t end = rows_.buckets.begin[r + 1];
      if (rows_.buckets.is_value[r] != 0 && end - begin > 1) {
        count += end - begin;
        continue;
      }
      if (!is_x_known) {
        any_in_x = find_tied_in_x();
        is_x_known = true;
      }
      if (mark(rows_, r, samples_.y) || any_in_x) {
        for (std::int64_t k = begin; k < end; ++k) {
          count += tied_[k - begin] | tied_in_x_[rows_.records[k].point()];
        }
      }
    }
    return count;
  }

private:
  bool find_tied_in_x() {
    for (std::int64_t i = 0; i < n_; ++i) {
      tied_in_x_[i] = 0;
    }
    bool any = false;
    for (std::int64_t c = 0; c < columns_.buckets.count; ++c) {
      if (mark(columns_, c, samples_.x)) {
        any = true;
        const std::int64_t begin = columns_.buckets.begin[c];
        for (std::int64_t k = begin; k < columns_.buckets.begin[c + 1]; ++k) {
          tied_in_x_[columns_.records[k].point()] = tied_[k - begin];
        }
      }
    }
    return any;
  }

  // Sets tied_ to 1 for each point of a bucket whose number another one has, else to 0; whether any
  // has one.
  bool mark(const KsBucketed& axis, std::int64_t bucket, const double* const values[2]) {
    const KsRecord* const record = axis.records + axis.buckets.begin[bucket];
    const std::int64_t n = axis.buckets.begin[bucket + 1] - axis.buckets.begin[bucket];
    const bool all = axis.buckets.is_value[bucket] != 0 && n > 1;
    for (std::int64_t i = 0; i < n; ++i) {
      tied_[i] = all;
    }
    if (all || (n <= most_compared && !may_be_tied(record, n))) {
      return all;
    }
    return throw_together(record, n, values);
  }

  // Points are thrown into a table, where the last stays. Those that meet another number go on to
  // the next round, with a table that is filled otherwise; from the second round on by all bits of
  // the number, as those of the hash may be the same.
  bool throw_together(const KsRecord* record, std::int64_t n, const double* const values[2]) {
    constexpr int table_bits = 9;
    constexpr int hash_shift = KsRecord::hash_bits - table_bits;
    std::uint16_t table[1 << table_bits];
    for (std::int64_t i = 0; i < n; ++i) {
      table[record[i].hash() >> hash_shift] = std::uint16_t(i);
    }
    std::int64_t left = 0;
    bool any = false;
    for (std::int64_t i = 0; i < n; ++i) {
      const std::uint32_t hash = record[i].hash();
      const std::uint16_t other = table[hash >> hash_shift];
      rest_[left] = std::uint16_t(i);
      if (hash == record[other].hash() && i != other &&
          value(record[i], values) == value(record[other], values)) {
        tied_[i] = tied_[other] = 1;
        any = true;
      } else {
        left += i != other;
      }
    }
    std::uint64_t factor = 0x9E3779B97F4A7C15u;
    while (left > 0) {
      factor = factor * 0xD1342543DE82EF95u + 2; // stays odd
      const auto slot_of = [&](double value) {
        return (ks_bits(value) * factor) >> (64 - table_bits);
      };
      for (std::int64_t j = 0; j < left; ++j) {
        table[slot_of(value(record[rest_[j]], values))] = rest_[j];
      }
      std::int64_t kept = 0;
      for (std::int64_t j = 0; j < left; ++j) {
        const std::uint16_t i = rest_[j];
        const double own = value(record[i], values);
        const std::uint16_t other = table[slot_of(own)];
        if (i != other && own == value(record[other], values)) {
          tied_[i] = tied_[other] = 1;
          any = true;
        } else {
          rest_[kept] = i;
          kept += i != other;
        }
      }
      left = kept;
    }
    return any;
  }

  double value(KsRecord record, const double* const values[2]) const {
    return record.value(values, samples_.n[0]);
  }

  // Whether two points of a bucket have the same short hash: each is compared with all that follow
  // it in a circle, up to the opposite one.
  static constexpr std::int64_t most_compared = 128;
  static bool may_be_tied(const KsRecord* record, std::int64_t n) {
    using Short = KsVector<std::int16_t>;
    constexpr std::int64_t room = 2 * most_compared + ks_padding;
    std::int16_t own[room];
    std::int16_t circle[room];
    for (std::int64_t i = 0; i < n; ++i) {
      own[i] = circle[i] = circle[i + n] =
          std::int16_t(record[i].hash() >> (KsRecord::hash_bits - 15));
    }
    for (std::int64_t i = 0; i < Short::lanes; ++i) { // no hash, and equal to none
      own[n + i] = -1;
      circle[2 * n + i] = -2;
    }
    typename Short::Type equal{};
    for (std::int64_t i = 0; i < n; i += Short::lanes) {
      const typename Short::Type hash = Short::load(own + i);
      for (std::int64_t step = 1; step <= n / 2; ++step) {
        equal |= (typename Short::Type)(hash == Short::load(circle + i + step));
      }
    }
    std::int16_t any = 0;
    for (int lane = 0; lane < Short::lanes; ++lane) {
      any |= equal[lane];
    }
    return any != 0;
  }

  const KsPlain& samples_;
  KsBucketed columns_;
  KsBucketed rows_;
  std::int64_t n_;
  std::uint8_t* tied_;      // by place in a bucket
  std::uint8_t* tied_in_x_; // by point
  std::uint16_t* rest_;     // places in a bucket
};

DRIFTWALK_LANES_END
