// One axis of the pooled points cut into buckets, on one instruction set.
//
// A bucket holds the points of an interval of the axis, so the buckets are in order, and equal
// numbers share one. The numbers are dealt to bins of an even scale, and neighbouring bins make a
// bucket. A bin that holds too many, because of far outliers or of numbers that differ by rounding
// alone, is cut at some of its own numbers; one that many points have is a bucket by itself. Equal
// numbers of such bins are looked for first: they are cut once, and known to be tied.
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
  std::uint16_t* of_point;  // (n) sample 2 after sample 1
  std::int32_t* size[2];    // by bucket: points of each sample
  std::uint8_t* is_value;   // by bucket: 1 where all its numbers are known to be equal
  std::uint8_t* knows_ties; // by bucket: 1 where its tied points are known
  std::int32_t* begin;      // by bucket, and the end: its first point where they lie in order
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

// Equal for equal numbers: -0.0 + 0.0 is +0.0.
inline std::uint64_t ks_bits(double value) {
  const double one_zero = value + 0.0;
  std::uint64_t bits;
  __builtin_memcpy(&bits, &one_zero, sizeof bits);
  return bits;
}

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
  // `tied`: by point, set to 1 where another point is known to have the same number.
  KsBucketer(const std::int64_t n[2], const KsBucketSizes& sizes, std::uint8_t* tied, char* scratch)
      : n_{n[0], n[1]}, least_(std::int32_t(sizes.points)), tied_(tied), bins_(sizes.bins) {
    const std::int64_t all = n[0] + n[1];
    counts_[0] = ks_take<std::int32_t>(scratch, bins_);
    counts_[1] = ks_take<std::int32_t>(scratch, bins_);
    cuts_begin_ = ks_take<std::int32_t>(scratch, bins_);
    cuts_ = ks_take<std::int32_t>(scratch, bins_);
    bucket_ = ks_take<std::uint16_t>(scratch, bins_);
    bin_ = ks_take<std::uint16_t>(scratch, all);
    point_ = ks_take<std::int32_t>(scratch, all);
    number_of_ = ks_take<std::int32_t>(scratch, all);
    table_bits_ = ks_bit_width(all) - 2;
    table_ = ks_take<std::int32_t>(scratch, std::int64_t(1) << table_bits_);
    number_ = ks_take<double>(scratch, all);
    counts_of_number_ = ks_take<Counts>(scratch, all);
    part_ = ks_take<std::int32_t>(scratch, all);
    cut_ = ks_take<double>(scratch, all);
    counts_of_part_ = ks_take<Counts>(scratch, all);
  }

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
        tied_[i] = 1;
      }
      fill({{std::int32_t(n_[0]), std::int32_t(n_[1])}});
      close(true, true);
    } else {
      if (!scale_.set(range.lowest, range.highest, bins_)) {
        return false;
      }
      deal(values);
      heavy_points_ = numbers_ = 0;
      if (is_crowded()) {
        list_heavy(values);
        place_cuts(values);
        find_parts();
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
  struct Counts {
    std::int32_t of[2];
    std::int32_t all() const { return of[0] + of[1]; }
  };

  void deal(const double* const values[2]) {
    std::uint16_t* bin = bin_;
    for (int sample = 0; sample < 2; ++sample) {
      std::int32_t* const counts = counts_[sample];
      for (std::int64_t b = 0; b < bins_; ++b) {
        counts[b] = 0;
      }
      const double* const value = values[sample];
      for (std::int64_t i = 0; i < n_[sample]; ++i) {
        bin[i] = std::uint16_t(scale_.bin(value[i]));
      }
      for (std::int64_t i = 0; i < n_[sample]; ++i) {
        ++counts[bin[i]];
      }
      bin += n_[sample];
    }
  }

  bool is_heavy(std::int64_t bin) const { return counts_[0][bin] + counts_[1][bin] > 3 * least_; }
  bool is_crowded() {
    bool any = false;
    for (std::int64_t bin = 0; bin < bins_; ++bin) {
      bucket_[bin] = is_heavy(bin); // until the bins have buckets
      any |= is_heavy(bin);
    }
    return any;
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
      cuts_begin_[bin] = end;
      end += is_heavy(bin) ? cuts_[bin] + 1 : 0;
      cuts_[bin] = 0;
    }
    for (std::int64_t i = 0; i < n; i += step) {
      const std::int64_t bin = bin_[i];
      if (is_heavy(bin)) {
        cut_[cuts_begin_[bin] + cuts_[bin]++] = i < n_[0] ? values[0][i] : values[1][i - n_[0]];
      }
    }
    std::int32_t most = 0;
    for (std::int64_t bin = 0; bin < bins_; ++bin) {
      if (is_heavy(bin)) {
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
      counts_of_part_[part] = {{0, 0}};
    }
  }

  // The points of heavy bins and their numbers, each once until the table is half full.
  void list_heavy(const double* const values[2]) {
    for (std::int64_t slot = 0; slot < std::int64_t(1) << table_bits_; ++slot) {
      table_[slot] = -1;
    }
    knows_ties_ = true;
    std::int64_t end = 0;
    std::int32_t point = 0;
    for (int sample = 0; sample < 2; ++sample) {
      const std::int64_t begin = end;
      const std::int32_t first = point;
      const double* const value = values[sample];
      for (std::int64_t i = 0; i < n_[sample]; ++i, ++point) {
        point_[end] = point;
        end += bucket_[bin_[point]];
      }
      const std::int32_t* const table = table_;
      const double* const number = number_;
      const int shift = 64 - table_bits_;
      std::int64_t k = begin;
      for (; k < end && knows_ties_; ++k) {
        const double own = value[point_[k] - first];
        const std::int64_t slot = std::int64_t((ks_bits(own) * 0x9E3779B97F4A7C15u) >> shift);
        const std::int32_t found = table[slot];
        number_of_[k] = found >= 0 && number[found] == own ? found : find_number(own, slot);
      }
      for (; k < end; ++k) {
        number_of_[k] = list_number(value[point_[k] - first]);
      }
      for (k = begin; k < end; ++k) {
        ++counts_of_number_[number_of_[k]].of[sample];
      }
    }
    heavy_points_ = end;
  }

  std::int32_t find_number(double value, std::int64_t slot) {
    const std::int64_t slots = std::int64_t(1) << table_bits_;
    for (; table_[slot] >= 0; slot = (slot + 1) & (slots - 1)) {
      if (number_[table_[slot]] == value) {
        return table_[slot];
      }
    }
    table_[slot] = numbers_;
    knows_ties_ = numbers_ < slots / 2;
    return list_number(value);
  }
  std::int32_t list_number(double value) {
    number_[numbers_] = value;
    counts_of_number_[numbers_] = {{0, 0}};
    return numbers_++;
  }

  // The part of every number of a heavy bin: twice the number of smaller cuts, and one more where
  // it is a cut. Many searches at a time: each waits for its last comparison.
  void find_parts() {
    constexpr std::int32_t block = 256;
    std::int64_t at[block];
    const double* const cut = cut_;
    for (std::int32_t begin = 0; begin < numbers_; begin += block) {
      const std::int32_t size = numbers_ - begin < block ? numbers_ - begin : block;
      const double* const own = number_ + begin;
      for (std::int32_t i = 0; i < size; ++i) {
        at[i] = cuts_begin_[scale_.bin(own[i])];
      }
      for (std::int64_t half = half_; half > 0; half /= 2) {
        for (std::int32_t i = 0; i < size; ++i) {
          at[i] += half & -std::int64_t(cut[at[i] + half - 1] < own[i]);
        }
      }
      for (std::int32_t i = 0; i < size; ++i) {
        const std::int32_t part = std::int32_t(2 * at[i]) + (cut[at[i]] == own[i]);
        part_[begin + i] = part;
        counts_of_part_[part].of[0] += counts_of_number_[begin + i].of[0];
        counts_of_part_[part].of[1] += counts_of_number_[begin + i].of[1];
      }
    }
  }

  // Every bin and every part of a heavy one gets its bucket.
  void join_bins() {
    bool was_heavy = false;
    for (std::int64_t bin = 0; bin < bins_; ++bin) {
      const bool heavy = is_heavy(bin);
      if (heavy != was_heavy && filled() > 0) {
        close(false, was_heavy && knows_ties_);
      }
      was_heavy = heavy;
      if (heavy) {
        join_parts(2 * cuts_begin_[bin], 2 * cuts_[bin] + 1);
      } else {
        bucket_[bin] = std::uint16_t(buckets_->count);
        fill({{counts_[0][bin], counts_[1][bin]}});
        if (filled() >= least_) {
          close(false, false);
        }
      }
    }
    if (filled() > 0) {
      close(false, was_heavy && knows_ties_);
    }
  }

  void join_parts(std::int32_t begin, std::int32_t count) {
    for (std::int32_t part = begin; part < begin + count; ++part) {
      Counts& counts = counts_of_part_[part];
      const bool is_value = part % 2 != 0 && counts.all() > least_;
      if ((is_value || counts.all() > 2 * least_) && filled() > 0) {
        close(false, knows_ties_);
      }
      const std::int32_t bucket = std::int32_t(buckets_->count);
      fill(counts);
      if (filled() >= least_) {
        close(is_value, is_value || knows_ties_);
      }
      counts.of[0] = bucket;
    }
  }

  // The bucket that is being filled comes after those that are counted.
  std::int32_t filled() const {
    return buckets_->size[0][buckets_->count] + buckets_->size[1][buckets_->count];
  }
  void fill(const Counts& counts) {
    buckets_->size[0][buckets_->count] += counts.of[0];
    buckets_->size[1][buckets_->count] += counts.of[1];
  }
  void close(bool is_value, bool knows_ties) {
    buckets_->is_value[buckets_->count] = is_value;
    buckets_->knows_ties[buckets_->count++] = knows_ties;
    buckets_->size[0][buckets_->count] = buckets_->size[1][buckets_->count] = 0;
  }

  void name() {
    std::uint16_t* const of_point = buckets_->of_point;
    for (std::int64_t i = 0; i < n_[0] + n_[1]; ++i) {
      of_point[i] = bucket_[bin_[i]];
    }
    for (std::int32_t i = 0; i < numbers_; ++i) {
      const std::int32_t bucket = counts_of_part_[part_[i]].of[0];
      const bool is_tied = buckets_->is_value[bucket] != 0 || counts_of_number_[i].all() > 1;
      part_[i] = 2 * bucket + is_tied;
    }
    // Local copies: a store of bytes could change any member, and they would be loaded again.
    const std::int32_t* const point = point_;
    const std::int32_t* const number_of = number_of_;
    const std::int32_t* const part = part_;
    std::uint8_t* const tied = tied_;
    for (std::int64_t k = 0, end = heavy_points_; k < end; ++k) {
      const std::int32_t named = part[number_of[k]];
      of_point[point[k]] = std::uint16_t(named / 2);
      tied[point[k]] |= named & 1;
    }
  }

  std::int64_t n_[2];
  std::int32_t least_;
  std::uint8_t* tied_;
  KsBuckets* buckets_ = nullptr;
  KsEvenScale scale_{};
  // By bin.
  std::int64_t bins_;
  std::int32_t* counts_[2];
  std::int32_t* cuts_begin_; // where it is heavy
  std::int32_t* cuts_;
  std::uint16_t* bucket_;
  std::uint16_t* bin_; // by point
  // The points of heavy bins and their numbers.
  std::int64_t heavy_points_ = 0;
  std::int32_t* point_;
  std::int32_t* number_of_;
  bool knows_ties_ = false; // each number is listed once
  int table_bits_;
  std::int32_t* table_;
  std::int32_t numbers_ = 0;
  double* number_;
  Counts* counts_of_number_;
  std::int32_t* part_; // then twice the bucket, and one more where points share the number
  // Where heavy bins are cut. The cuts and what lies between them are the parts.
  double* cut_;
  std::int64_t half_ = 0;  // of the most cuts of a bin, a power of two
  Counts* counts_of_part_; // then the bucket
};

DRIFTWALK_LANES_END
