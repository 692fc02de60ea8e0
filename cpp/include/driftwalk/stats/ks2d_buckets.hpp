// One axis of the pooled points cut into buckets, on one instruction set.
//
// A bucket holds the points of an interval of the axis, so the buckets are in order, and equal
// numbers share one. The numbers are dealt to bins of an even scale, and neighbouring bins make a
// bucket. A bin that holds too many is dealt again on a scale of its own, which resolves far
// outliers and clusters of numbers that differ by rounding alone, and is a bucket where its numbers
// are equal.
#pragma once

#include "driftwalk/config.hpp"
#include "driftwalk/stats/ks2d_kernel.hpp"
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

// The buckets of one axis.
struct KsBuckets {
  std::uint16_t* of_point; // (n) sample 2 after sample 1
  std::int32_t* size[2];   // by bucket: points of each sample
  std::uint8_t* is_value;  // by bucket: 1 where all its numbers are known to be equal
  std::int32_t* begin;     // by bucket, and the end: its first point where they lie in order
  std::int64_t count;
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

  void widen(const double* values, std::int64_t n) {
    using Vector = KsVector<double>;
    typename Vector::Type low = Vector::Type{} + lowest;
    typename Vector::Type high = Vector::Type{} + highest;
    std::int64_t i = 0;
    for (; i + Vector::lanes <= n; i += Vector::lanes) {
      const typename Vector::Type value = Vector::load(values + i);
      low = value < low ? value : low;
      high = value > high ? value : high;
    }
    for (int lane = 0; lane < Vector::lanes; ++lane) {
      lowest = low[lane] < lowest ? low[lane] : lowest;
      highest = high[lane] > highest ? high[lane] : highest;
    }
    for (; i < n; ++i) {
      lowest = values[i] < lowest ? values[i] : lowest;
      highest = values[i] > highest ? values[i] : highest;
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

// Numbers in order, equal ones once; returns how many are left.
inline std::int32_t ks_sort_unique(double* values, std::int32_t n) {
  std::int32_t gap = 1;
  while (gap < n / 3) {
    gap = 3 * gap + 1;
  }
  for (; gap > 0; gap /= 3) {
    for (std::int32_t i = gap; i < n; ++i) {
      const double value = values[i];
      std::int32_t j = i;
      for (; j >= gap && values[j - gap] > value; j -= gap) {
        values[j] = values[j - gap];
      }
      values[j] = value;
    }
  }
  std::int32_t kept = 0;
  for (std::int32_t i = 0; i < n; ++i) {
    const double value = values[i];
    kept += kept == 0 || values[kept - 1] != value;
    values[kept - 1] = value;
  }
  return kept;
}

class KsBucketer {
public:
  // `list`: room for n numbers of 64 bits in each.
  KsBucketer(const std::int64_t n[2], const KsBucketSizes& sizes, char* scratch,
             double* const lists[4])
      : n_{n[0], n[1]}, least_(std::int32_t(sizes.points)), bins_(sizes.bins),
        counts_{ks_take<std::int32_t>(scratch, bins_), ks_take<std::int32_t>(scratch, bins_)},
        cuts_begin_(ks_take<std::int32_t>(scratch, bins_)),
        cuts_(ks_take<std::int32_t>(scratch, bins_)),
        bucket_(ks_take<std::uint16_t>(scratch, bins_)),
        bin_(ks_take<std::uint16_t>(scratch, n[0] + n[1])),
        point_(reinterpret_cast<std::int32_t*>(lists[0])),
        part_(reinterpret_cast<std::int32_t*>(lists[1])), cut_(lists[2]),
        part_counts_(reinterpret_cast<PartCounts*>(lists[3])) {}

  // False where the range of the numbers is too large or too small for an even scale.
  bool cut(const double* const values[2], KsBuckets& buckets) {
    buckets_ = &buckets;
    buckets.count = 0;
    buckets.size[0][0] = buckets.size[1][0] = 0;
    KsRange range{values[0][0], values[0][0]};
    range.widen(values[0], n_[0]);
    range.widen(values[1], n_[1]);
    if (range.lowest == range.highest) {
      for (std::int64_t i = 0; i < n_[0] + n_[1]; ++i) {
        buckets.of_point[i] = 0;
      }
      fill(std::int32_t(n_[0]), std::int32_t(n_[1]));
      close(true);
    } else {
      KsEvenScale scale;
      if (!scale.set(range.lowest, range.highest, bins_)) {
        return false;
      }
      deal(values, scale);
      heavy_points_ = 0;
      if (is_crowded()) {
        place_cuts(values);
        deal_heavy(values);
      }
      join_bins();
      name();
    }
    std::int32_t begin = 0;
    for (std::int64_t b = 0; b < buckets.count; ++b) {
      buckets.begin[b] = begin;
      begin += buckets.size[0][b] + buckets.size[1][b];
    }
    buckets.begin[buckets.count] = begin;
    return true;
  }

private:
  // Points of a part of a heavy bin: parts are the cuts and what lies between them.
  struct PartCounts {
    std::int32_t of[2];
  };

  void deal(const double* const values[2], const KsEvenScale& scale) {
    std::uint16_t* bin = bin_;
    for (int sample = 0; sample < 2; ++sample) {
      std::int32_t* const counts = counts_[sample];
      for (std::int64_t b = 0; b < bins_; ++b) {
        counts[b] = 0;
      }
      const double* const value = values[sample];
      for (std::int64_t i = 0; i < n_[sample]; ++i) {
        bin[i] = std::uint16_t(scale.bin(value[i]));
      }
      for (std::int64_t i = 0; i < n_[sample]; ++i) {
        ++counts[bin[i]];
      }
      bin += n_[sample];
    }
  }

  bool is_heavy(std::int64_t bin) const { return counts_[0][bin] + counts_[1][bin] > 3 * least_; }
  bool is_crowded() const {
    bool heavy = false;
    for (std::int64_t bin = 0; bin < bins_; ++bin) {
      heavy |= is_heavy(bin);
    }
    return heavy;
  }

  // Some numbers of every heavy bin, in order and each once; infinity comes behind them.
  void place_cuts(const double* const values[2]) {
    const std::int64_t n = n_[0] + n_[1];
    const std::int64_t step = least_;
    for (std::int64_t bin = 0; bin < bins_; ++bin) {
      cuts_[bin] = 0;
    }
    for (std::int64_t i = 0; i < n; i += step) {
      ++cuts_[bin_[i]];
    }
    std::int32_t end = 1;
    for (std::int64_t bin = 0; bin < bins_; ++bin) {
      cuts_begin_[bin] = is_heavy(bin) ? end : -1;
      end += is_heavy(bin) ? cuts_[bin] + 1 : 0;
      cuts_[bin] = 0;
    }
    for (std::int64_t i = 0; i < n; i += step) {
      const std::int64_t bin = bin_[i];
      if (cuts_begin_[bin] >= 0) {
        cut_[cuts_begin_[bin] + cuts_[bin]++] = i < n_[0] ? values[0][i] : values[1][i - n_[0]];
      }
    }
    std::int32_t most = 0;
    for (std::int64_t bin = 0; bin < bins_; ++bin) {
      if (cuts_begin_[bin] >= 0) {
        double* const cut = cut_ + cuts_begin_[bin];
        const std::int32_t all = cuts_[bin];
        cuts_[bin] = ks_sort_unique(cut, all);
        for (std::int32_t i = cuts_[bin]; i <= all; ++i) {
          cut[i] = __builtin_inf();
        }
        most = cuts_[bin] > most ? cuts_[bin] : most;
      }
    }
    half_ = (std::int64_t(1) << ks_bit_width(most)) / 2;
    cut_[0] = 0;
    for (std::int64_t i = 0; i < 2 * half_; ++i) {
      cut_[end + i] = __builtin_inf();
    }
    for (std::int32_t part = 0; part < 2 * end; ++part) {
      part_counts_[part] = {{0, 0}};
    }
  }

  // The part of every point of a heavy bin: twice the number of smaller cuts, and one more where it
  // lies on a cut. Many searches at a time: each waits for its last comparison.
  void deal_heavy(const double* const values[2]) {
    constexpr int block = 256;
    double own[block];
    std::int64_t at[block];
    heavy_points_ = 0;
    std::int64_t first = 0;
    for (int sample = 0; sample < 2; ++sample) {
      for (std::int64_t begin = 0; begin < n_[sample]; begin += block) {
        const int size = n_[sample] - begin < block ? int(n_[sample] - begin) : block;
        std::int32_t* const point = point_ + heavy_points_;
        std::int32_t* const part = part_ + heavy_points_;
        const double* const value = values[sample] + begin;
        const std::uint16_t* const bin = bin_ + first + begin;
        int heavy = 0;
        for (int i = 0; i < size; ++i) {
          const std::int32_t cuts_begin = cuts_begin_[bin[i]];
          point[heavy] = i;
          at[heavy] = cuts_begin;
          heavy += cuts_begin >= 0;
        }
        for (int k = 0; k < heavy; ++k) {
          own[k] = value[point[k]];
          point[k] += std::int32_t(first + begin);
        }
        const double* const cut = cut_;
        for (std::int64_t half = half_; half > 0; half /= 2) {
          for (int k = 0; k < heavy; ++k) {
            at[k] += half & -std::int64_t(cut[at[k] + half - 1] < own[k]);
          }
        }
        for (int k = 0; k < heavy; ++k) {
          part[k] = std::int32_t(2 * at[k]) + (cut[at[k]] == own[k]);
        }
        for (int k = 0; k < heavy; ++k) {
          ++part_counts_[part[k]].of[sample];
        }
        heavy_points_ += heavy;
      }
      first += n_[sample];
    }
  }

  // Every bin and every part of a heavy one gets its bucket.
  void join_bins() {
    for (std::int64_t bin = 0; bin < bins_; ++bin) {
      if (is_heavy(bin)) {
        join_parts(2 * cuts_begin_[bin], 2 * cuts_[bin] + 1);
      } else {
        bucket_[bin] = std::uint16_t(buckets_->count);
        fill(counts_[0][bin], counts_[1][bin]);
        if (filled() >= least_) {
          close(false);
        }
      }
    }
    if (filled() > 0) {
      close(false);
    }
  }

  void join_parts(std::int32_t begin, std::int32_t count) {
    for (std::int32_t part = begin; part < begin + count; ++part) {
      PartCounts& counts = part_counts_[part];
      const bool is_value = part % 2 != 0 && counts.of[0] + counts.of[1] > least_;
      const bool is_large = is_value || counts.of[0] + counts.of[1] > 2 * least_;
      if (is_large && filled() > 0) {
        close(false);
      }
      const std::int32_t bucket = std::int32_t(buckets_->count);
      fill(counts.of[0], counts.of[1]);
      if (filled() >= least_) {
        close(is_value);
      }
      counts.of[0] = bucket;
    }
  }

  // The bucket that is being filled comes after those that are counted.
  std::int32_t filled() const {
    return buckets_->size[0][buckets_->count] + buckets_->size[1][buckets_->count];
  }
  void fill(std::int32_t first, std::int32_t second) {
    buckets_->size[0][buckets_->count] += first;
    buckets_->size[1][buckets_->count] += second;
  }
  void close(bool is_value) {
    buckets_->is_value[buckets_->count++] = is_value;
    buckets_->size[0][buckets_->count] = buckets_->size[1][buckets_->count] = 0;
  }

  void name() {
    std::uint16_t* const of_point = buckets_->of_point;
    for (std::int64_t i = 0; i < n_[0] + n_[1]; ++i) {
      of_point[i] = bucket_[bin_[i]];
    }
    for (std::int64_t k = 0; k < heavy_points_; ++k) {
      of_point[point_[k]] = std::uint16_t(part_counts_[part_[k]].of[0]);
    }
  }

  std::int64_t n_[2];
  std::int32_t least_;
  KsBuckets* buckets_ = nullptr;
  // By bin.
  std::int64_t bins_;
  std::int32_t* counts_[2];
  std::int32_t* cuts_begin_; // -1: it is not heavy
  std::int32_t* cuts_;
  std::uint16_t* bucket_;
  std::uint16_t* bin_; // by point
  // The points of heavy bins, and where they are cut.
  std::int64_t heavy_points_ = 0;
  std::int32_t* point_;
  std::int32_t* part_;
  double* cut_;
  std::int64_t half_ = 0;   // of the most cuts of a bin, a power of two
  PartCounts* part_counts_; // then the bucket of the part
};

DRIFTWALK_LANES_END
