// One axis of the pooled points cut into buckets, on one instruction set.
//
// A bucket holds the points of an interval of the axis, so the buckets are in order, and equal
// numbers share one. The numbers are dealt to bins of an even scale, and neighbouring bins make a
// bucket. A bin that holds too many is dealt again on a scale of its own, which resolves far
// outliers and clusters of numbers that differ by rounding alone, and is a bucket where its numbers
// are equal.
#pragma once

#include "driftwalk/config.hpp"
#include "driftwalk/stats/ks2d_sweep.hpp"

#include <cstdint>

DRIFTWALK_LANES_BEGIN

// Part of the scratch memory of a call, aligned to 64.
template <class T>
inline T* ks_take(char*& at, std::int64_t count) {
  T* const begin = reinterpret_cast<T*>(at);
  at += (count * std::int64_t(sizeof(T)) + 63) / 64 * 64;
  return begin;
}

inline constexpr std::uint16_t ks_no_bucket = 0xFFFF;

// The buckets of one axis.
struct KsBuckets {
  std::uint16_t* of_point; // (n) sample 2 after sample 1
  std::int32_t* size[2];   // by bucket: points of each sample
  std::uint8_t* is_value;  // by bucket: 1 where all its numbers are known to be equal
  std::int32_t* begin;     // by bucket, and the end: its first point where they lie in order
  std::int64_t count;
};

// Numbers with the points that they belong to.
struct KsNumbers {
  double* value;
  std::int32_t* point;
};

struct KsEvenScale {
  double smallest;
  double factor;

  // Not usable where the difference of two numbers overflows, nor where it is next to nothing.
  bool set(double lowest, double highest, std::int64_t bins) {
    smallest = lowest;
    factor = double(bins - 1) / (highest - lowest);
    return factor > 0 && factor <= 0x1.fffffffffffffp+1023;
  }
  std::int32_t bin(double value) const { return std::int32_t((value - smallest) * factor); }
};

struct KsRange {
  double lowest;
  double highest;

  // Several at a time: each waits for its last comparison.
  void widen(const double* values, std::int64_t n) {
    constexpr int lanes = 16;
    double low[lanes];
    double high[lanes];
    for (int lane = 0; lane < lanes; ++lane) {
      low[lane] = lowest;
      high[lane] = highest;
    }
    std::int64_t i = 0;
    for (; i + lanes <= n; i += lanes) {
      for (int lane = 0; lane < lanes; ++lane) {
        const double value = values[i + lane];
        low[lane] = value < low[lane] ? value : low[lane];
        high[lane] = value > high[lane] ? value : high[lane];
      }
    }
    for (; i < n; ++i) {
      low[0] = values[i] < low[0] ? values[i] : low[0];
      high[0] = values[i] > high[0] ? values[i] : high[0];
    }
    for (int lane = 0; lane < lanes; ++lane) {
      lowest = low[lane] < lowest ? low[lane] : lowest;
      highest = high[lane] > highest ? high[lane] : highest;
    }
  }
};

inline int ks_bit_width(std::int64_t n) {
  int bits = 0;
  while (n >> bits != 0) {
    ++bits;
  }
  return bits;
}

class KsBucketer {
public:
  // `lists`: room for n + 1 numbers in each.
  KsBucketer(const std::int64_t n[2], const KsBucketSizes& sizes, char* scratch,
             const KsNumbers lists[2])
      : n_{n[0], n[1]}, least_(std::int32_t(sizes.points)), lists_{lists[0], lists[1]} {
    bins_ = sizes.bins;
    counts_ = ks_take<std::int32_t>(scratch, bins_);
    ends_ = ks_take<End>(scratch, bins_);
    bucket_ = ks_take<std::uint16_t>(scratch, bins_);
    bin_ = ks_take<std::uint16_t>(scratch, n[0] + n[1]);
  }

  // False where the numbers crowd too much for even scales.
  bool cut(const double* const values[2], KsBuckets& buckets) {
    buckets_ = &buckets;
    buckets.count = 0;
    KsRange range{values[0][0], values[0][0]};
    range.widen(values[0], n_[0]);
    range.widen(values[1], n_[1]);
    const std::int64_t n = n_[0] + n_[1];
    if (range.lowest == range.highest) {
      for (std::int64_t i = 0; i < n; ++i) {
        bin_[i] = 0;
      }
      bucket_[0] = 0;
      buckets.is_value[0] = 1;
      buckets.count = 1;
      name_and_count();
      return true;
    }
    KsEvenScale scale;
    if (!scale.set(range.lowest, range.highest, bins_)) {
      return false;
    }
    deal(values, scale);
    if (is_crowded()) {
      list_heavy(values);
    }
    if (!join_bins()) {
      return false;
    }
    name_and_count();
    return true;
  }

private:
  // Where the next number of a bin goes in the list.
  struct End {
    std::int32_t at;
    std::int32_t step;
  };

  void deal(const double* const values[2], const KsEvenScale& scale) {
    for (std::int64_t bin = 0; bin < bins_; ++bin) {
      counts_[bin] = 0;
    }
    std::uint16_t* bin = bin_;
    for (int sample = 0; sample < 2; ++sample) {
      const double* const value = values[sample];
      for (std::int64_t i = 0; i < n_[sample]; ++i) {
        bin[i] = std::uint16_t(scale.bin(value[i]));
      }
      bin += n_[sample];
    }
    for (std::int64_t i = 0; i < n_[0] + n_[1]; ++i) {
      ++counts_[bin_[i]];
    }
  }

  bool is_heavy(std::int64_t bin) const { return counts_[bin] > 2 * least_; }
  bool is_crowded() const {
    bool heavy = false;
    for (std::int64_t bin = 0; bin < bins_; ++bin) {
      heavy |= is_heavy(bin);
    }
    return heavy;
  }

  // The numbers of heavy bins, bin by bin; all others are written behind the end.
  void list_heavy(const double* const values[2]) {
    const std::int32_t trash = std::int32_t(n_[0] + n_[1]);
    std::int32_t end = 0;
    for (std::int64_t bin = 0; bin < bins_; ++bin) {
      const bool heavy = is_heavy(bin);
      ends_[bin] = {heavy ? end : trash, heavy};
      end += heavy ? counts_[bin] : 0;
    }
    std::int32_t point = 0;
    for (int sample = 0; sample < 2; ++sample) {
      for (std::int64_t i = 0; i < n_[sample]; ++i, ++point) {
        End& to = ends_[bin_[point]];
        lists_[0].value[to.at] = values[sample][i];
        lists_[0].point[to.at] = point;
        to.at += to.step;
      }
    }
  }

  // Every bin gets its bucket.
  bool join_bins() {
    std::int32_t filled = 0;
    for (std::int64_t bin = 0; bin < bins_; ++bin) {
      if (is_heavy(bin)) {
        close(filled);
        bucket_[bin] = ks_no_bucket;
        if (!deal_again(0, ends_[bin].at - counts_[bin], counts_[bin], 0)) {
          return false;
        }
      } else {
        bucket_[bin] = std::uint16_t(buckets_->count);
        fill(counts_[bin], filled);
      }
    }
    close(filled);
    return buckets_->count < ks_no_bucket;
  }

  void fill(std::int32_t points, std::int32_t& filled) {
    filled += points;
    if (filled >= least_) {
      close(filled);
    }
  }
  void close(std::int32_t& filled) {
    if (filled > 0) {
      buckets_->is_value[buckets_->count++] = 0;
      filled = 0;
    }
  }
  void put_all(const KsNumbers& numbers, std::int64_t begin, std::int64_t n) {
    for (std::int64_t i = begin; i < begin + n; ++i) {
      buckets_->of_point[numbers.point[i]] = std::uint16_t(buckets_->count);
    }
  }

  // Cut a part of a list on a scale of its own; the other list takes the numbers in order of bins.
  bool deal_again(int list, std::int64_t begin, std::int64_t n, int depth) {
    constexpr int most_depth = 4;
    constexpr int most_bits = 10;
    const KsNumbers from = lists_[list];
    const KsNumbers to = lists_[1 - list];
    KsRange range{from.value[begin], from.value[begin]};
    range.widen(from.value + begin, n);
    if (range.lowest == range.highest) {
      put_all(from, begin, n);
      buckets_->is_value[buckets_->count++] = 1;
      return true;
    }
    int bits = ks_bit_width(n) - 2;
    bits = bits < 4 ? 4 : bits > most_bits ? most_bits : bits;
    KsEvenScale scale;
    if (depth == most_depth || !scale.set(range.lowest, range.highest, std::int64_t(1) << bits)) {
      return false;
    }
    std::int32_t ends[1 << most_bits] = {};
    for (std::int64_t i = begin; i < begin + n; ++i) {
      ++ends[scale.bin(from.value[i])];
    }
    std::int32_t sum = std::int32_t(begin);
    for (std::int64_t bin = 0; bin < std::int64_t(1) << bits; ++bin) {
      const std::int32_t size = ends[bin];
      ends[bin] = sum;
      sum += size;
    }
    for (std::int64_t i = begin; i < begin + n; ++i) {
      const std::int32_t at = ends[scale.bin(from.value[i])]++;
      to.value[at] = from.value[i];
      to.point[at] = from.point[i];
    }
    std::int32_t filled = 0;
    std::int64_t done = begin;
    for (std::int64_t bin = 0; bin < std::int64_t(1) << bits; ++bin) {
      const std::int32_t size = std::int32_t(ends[bin] - done);
      if (size > 2 * least_) {
        close(filled);
        if (!deal_again(1 - list, done, size, depth + 1)) {
          return false;
        }
      } else {
        put_all(to, done, size);
        fill(size, filled);
      }
      done = ends[bin];
    }
    close(filled);
    return buckets_->count < ks_no_bucket;
  }

  void name_and_count() {
    std::uint16_t* of_point = buckets_->of_point;
    const std::uint16_t* bin = bin_;
    for (int sample = 0; sample < 2; ++sample) {
      std::int32_t* const size = buckets_->size[sample];
      for (std::int64_t b = 0; b < buckets_->count; ++b) {
        size[b] = 0;
      }
      for (std::int64_t i = 0; i < n_[sample]; ++i) {
        const std::uint16_t bucket = bucket_[bin[i]];
        // Points that were dealt again have theirs already.
        of_point[i] = bucket == ks_no_bucket ? of_point[i] : bucket;
        ++size[of_point[i]];
      }
      of_point += n_[sample];
      bin += n_[sample];
    }
    std::int32_t begin = 0;
    for (std::int64_t b = 0; b < buckets_->count; ++b) {
      buckets_->begin[b] = begin;
      begin += buckets_->size[0][b] + buckets_->size[1][b];
    }
    buckets_->begin[buckets_->count] = begin;
  }

  std::int64_t n_[2];
  std::int32_t least_;
  KsNumbers lists_[2];
  KsBuckets* buckets_ = nullptr;
  std::int64_t bins_;
  // By bin.
  std::int32_t* counts_;
  End* ends_;
  std::uint16_t* bucket_;
  std::uint16_t* bin_; // by point
};

DRIFTWALK_LANES_END
