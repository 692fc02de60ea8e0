// One axis of the pooled points cut into buckets, on one instruction set.
//
// A bucket holds the points of an interval of the axis, so the buckets are in order, and equal
// numbers share one. The numbers are dealt to bins of an even scale, and neighbouring bins make a
// bucket. A bin that is crowded, because of far outliers or of numbers that differ by rounding
// alone, is cut once more, evenly between its own numbers; one that many points have is a bucket by
// itself.
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

// Equal for equal numbers: -0.0 + 0.0 is +0.0.
inline std::uint64_t ks_bits(double value) {
  const double one_zero = value + 0.0;
  std::uint64_t bits;
  __builtin_memcpy(&bits, &one_zero, sizeof bits);
  return bits;
}

// In the order of the numbers, and even in their exponents: so are numbers spread over many
// decades.
inline double ks_exponent(double value) {
  const std::int64_t bits = std::int64_t(ks_bits(value));
  return double(bits ^ (bits >> 63 & 0x7FFFFFFFFFFFFFFF));
}

// How a bin is cut: evenly from the smallest to the largest of a sample of its numbers. What lies
// beyond them gets a bin on either side; where they are equal, the bin between holds that number
// alone.
struct KsSplit {
  double lowest;
  double factor;
  double parts;
  std::int32_t below; // the first bin that it is cut into

  // From 0 to the number of parts.
  std::int32_t part(double value) const {
    // Infinity times zero, where nothing can be cut, is no number and counts as zero.
    const double place = (value - lowest) * factor;
    const double above = place > 0 ? place : 0;
    return std::int32_t(above < parts ? above : parts);
  }
  std::int32_t bin(double value) const { return below + (value >= lowest) + part(value); }
};

class KsBucketer {
public:
  KsBucketer(const std::int64_t n[2], const KsBucketSizes& sizes, char* scratch)
      : n_{n[0], n[1]}, least_(std::int32_t(sizes.points)), even_bins_(std::int32_t(sizes.bins)),
        most_bins_(std::int32_t(sizes.most_bins)) {
    const std::int64_t all = n[0] + n[1];
    counts_[0] = ks_take<std::int32_t>(scratch, most_bins_);
    counts_[1] = ks_take<std::int32_t>(scratch, most_bins_);
    holds_value_ = ks_take<std::uint8_t>(scratch, most_bins_);
    crowd_of_ = ks_take<std::uint16_t>(scratch, most_bins_);
    bucket_ = ks_take<std::uint16_t>(scratch, most_bins_);
    leaf_ = ks_take<std::int32_t>(scratch, most_bins_);
    split_ = ks_take<KsSplit>(scratch, most_bins_);
    crowd_ = ks_take<Crowd>(scratch, most_bins_);
    sample_ = ks_take<double>(scratch, all / least_ + 1);
    bin_of_sample_ = ks_take<std::uint16_t>(scratch, all / least_ + 1);
    bin_ = ks_take<std::uint16_t>(scratch, all);
    point_ = ks_take<std::int32_t>(scratch, all);
  }

  // False where bins are crowded still when they were cut six times, or where bins run out.
  bool cut(const double* const values[2], KsBuckets& buckets) {
    constexpr int most_rounds = 6;
    if (!deal(values)) {
      return false;
    }
    // In buckets of points. To look at all points again takes longer than a few wide buckets.
    // Chosen by the time of 18,000 and 100,000 steps on pixels, of rounded and of other numbers.
    const std::int32_t most = (bins_ > first_bins_ ? 8 : 3) * least_;
    std::int32_t newest = 0;
    for (int round = 0; find_crowds(newest, most); ++round) {
      newest = bins_;
      by_exponent_ = round == 2 || round == 4;
      list_crowds(round == 0);
      sample_crowds(values);
      if (round == most_rounds || !cut_crowds(listed_[1], 1)) {
        return false;
      }
      deal_crowds(values);
    }
    leaves_ = 0;
    for (std::int32_t bin = 0; bin < first_bins_; ++bin) {
      list_leaves(bin);
    }
    join_leaves(buckets);
    for (std::int64_t i = 0; i < n_[0] + n_[1]; ++i) {
      buckets.of_point[i] = bucket_[bin_[i]];
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
  // A bin with too many points, what some of its numbers lie between, and the bins it is cut into.
  struct Crowd {
    double lowest;
    double highest;
    std::int32_t bin;
    std::int32_t begin;
    std::int32_t end;

    void widen(double value) {
      lowest = value < lowest ? value : lowest;
      highest = value > highest ? value : highest;
    }
  };

  std::int32_t count(std::int32_t bin) const { return counts_[0][bin] + counts_[1][bin]; }
  double value_of(const double* const values[2], std::int64_t i) const {
    return i < n_[0] ? values[0][i] : values[1][i - n_[0]];
  }

  double scaled(double value) const { return by_exponent_ ? ks_exponent(value) : value; }

  // Deal all points to the bins of an even scale. Where most of a sample is crowded there, cut
  // these bins by the sample first. False where bins run out.
  bool deal(const double* const values[2]) {
    sampled_ = 0;
    for (std::int64_t i = 0; i < n_[0] + n_[1]; i += least_) {
      sample_[sampled_++] = value_of(values, i);
    }
    Crowd all{largest, -largest, 0, 0, 0};
    for (std::int32_t k = 0; k < sampled_; ++k) {
      all.widen(sample_[k]);
    }
    bins_ = crowds_ = 0;
    by_exponent_ = false;
    const KsSplit first = cut_evenly(all, even_bins_);
    first_bins_ = bins_;
    holds_value_[1] = 0; // there is none below the first
    std::int32_t* const counts = counts_[0];
    for (std::int32_t k = 0; k < sampled_; ++k) {
      bin_of_sample_[k] = std::uint16_t(first.part(sample_[k]));
    }
    for (std::int32_t k = 0; k < sampled_; ++k) {
      ++counts[bin_of_sample_[k]];
    }
    std::int32_t crowded = 0;
    for (std::int32_t k = 0; k < sampled_; ++k) {
      crowded += counts[bin_of_sample_[k]] > 3;
    }
    const bool cuts = 2 * crowded > sampled_;
    if (cuts) {
      for (std::int32_t bin = 0; bin < bins_; ++bin) {
        split_[bin] = {-largest, 0, 0, bin - 1}; // as it is
      }
      find_crowds(0, 1);
      if (!cut_crowds(n_[0] + n_[1], least_)) {
        return false;
      }
    }
    for (std::int32_t bin = 0; bin < first_bins_; ++bin) {
      counts[bin] = 0;
    }
    std::uint16_t* bin = bin_;
    for (int sample = 0; sample < 2; ++sample) {
      const double* const value = values[sample];
      for (std::int64_t i = 0; i < n_[sample]; ++i) {
        bin[i] = std::uint16_t(first.part(value[i]));
      }
      if (cuts) {
        const KsSplit* const split = split_;
        for (std::int64_t i = 0; i < n_[sample]; ++i) {
          bin[i] = std::uint16_t(split[bin[i]].bin(value[i]));
        }
      }
      std::int32_t* const count = counts_[sample];
      for (std::int64_t i = 0; i < n_[sample]; ++i) {
        ++count[bin[i]];
      }
      bin += n_[sample];
    }
    return true;
  }

  // Whether one of the newest bins holds more points than that.
  bool find_crowds(std::int32_t newest, std::int32_t most) {
    first_crowd_ = crowds_;
    for (std::int32_t bin = newest; bin < bins_; ++bin) {
      if (count(bin) > most && holds_value_[bin] == 0) {
        crowd_[crowds_] = {largest, -largest, bin, 0, 0};
        crowd_of_[bin] = std::uint16_t(++crowds_);
      }
    }
    return crowds_ > first_crowd_;
  }

  void list_crowds(bool is_first) {
    const std::int64_t ends[2] = {is_first ? n_[0] : listed_[0],
                                  is_first ? n_[0] + n_[1] : listed_[1]};
    std::int64_t k = 0;
    std::int64_t end = 0;
    for (int sample = 0; sample < 2; ++sample) {
      for (; k < ends[sample]; ++k) {
        const std::int32_t point = is_first ? std::int32_t(k) : point_[k];
        point_[end] = point;
        end += crowd_of_[bin_[point]] != 0;
      }
      listed_[sample] = end;
    }
  }

  void sample_crowds(const double* const values[2]) {
    sampled_ = 0;
    for (std::int64_t k = 0; k < listed_[1]; k += least_) {
      bin_of_sample_[sampled_] = bin_[point_[k]];
      sample_[sampled_++] = value_of(values, point_[k]);
    }
  }

  // Cut the newest crowds by the sample. A count of a bin stands for so many of the points that
  // will be dealt. False where bins run out.
  bool cut_crowds(std::int64_t points, std::int32_t weight) {
    for (std::int32_t k = 0; k < sampled_; ++k) {
      const std::uint16_t crowd = crowd_of_[bin_of_sample_[k]];
      if (crowd != 0) {
        crowd_[crowd - 1].widen(sample_[k]);
      }
    }
    const std::int32_t bins_left = most_bins_ - bins_ - 3 * (crowds_ - first_crowd_);
    if (bins_left < 0) {
      return false;
    }
    // Twice the points to a bin of the first bins, and room for another round.
    const double even = double(even_bins_) / double(n_[0] + n_[1]);
    const double room = double(bins_left) / double(points);
    const double bins_per_count = (even < room ? even : room) / 2 * weight;
    for (std::int32_t c = first_crowd_; c < crowds_; ++c) {
      Crowd& crowd = crowd_[c];
      split_[crowd.bin] = cut_evenly(crowd, 1 + std::int32_t(bins_per_count * count(crowd.bin)));
    }
    return true;
  }

  KsSplit cut_evenly(Crowd& crowd, std::int32_t parts) {
    const double lowest = scaled(crowd.lowest);
    const double highest = scaled(crowd.highest);
    const bool has_one = lowest >= highest; // or none was looked at
    parts = has_one ? 1 : parts;
    crowd.begin = bins_;
    crowd.end = bins_ + parts + 2;
    for (std::int32_t bin = bins_, end = crowd.end; bin < end; ++bin) {
      counts_[0][bin] = counts_[1][bin] = 0;
      holds_value_[bin] = 0;
      crowd_of_[bin] = 0;
    }
    bins_ = crowd.end;
    holds_value_[crowd.begin + 1] = has_one && !by_exponent_; // exponents are rounded
    const double range = has_one ? 0 : highest - lowest;
    return {lowest, double(parts) / range, double(parts), crowd.begin};
  }

  void deal_crowds(const double* const values[2]) {
    const KsSplit* const split = split_;
    std::uint16_t* const bin = bin_;
    std::int64_t k = 0;
    for (int sample = 0; sample < 2; ++sample) {
      std::int32_t* const counts = counts_[sample];
      const double* const value = values[sample];
      const std::int64_t first = sample == 0 ? 0 : n_[0];
      for (; k < listed_[sample]; ++k) {
        const std::int32_t i = point_[k];
        const std::int32_t own = split[bin[i]].bin(scaled(value[i - first]));
        bin[i] = std::uint16_t(own);
        ++counts[own];
      }
    }
  }

  // The bins that are not cut, in order.
  void list_leaves(std::int32_t bin) {
    if (crowd_of_[bin] == 0) {
      leaf_[leaves_++] = bin;
      return;
    }
    const Crowd& crowd = crowd_[crowd_of_[bin] - 1];
    for (std::int32_t part = crowd.begin; part < crowd.end; ++part) {
      list_leaves(part);
    }
  }

  // Neighbouring bins share a bucket; many points of one number have a bucket of their own.
  void join_leaves(KsBuckets& buckets) {
    std::int64_t bucket = 0;
    std::int32_t size[2] = {0, 0};
    const auto close = [&](bool is_value) {
      buckets.size[0][bucket] = size[0];
      buckets.size[1][bucket] = size[1];
      buckets.is_value[bucket++] = is_value;
      size[0] = size[1] = 0;
    };
    const std::int32_t least = least_;
    for (std::int32_t k = 0, leaves = leaves_; k < leaves; ++k) {
      const std::int32_t bin = leaf_[k];
      const std::int32_t own[2] = {counts_[0][bin], counts_[1][bin]};
      const std::int32_t all = own[0] + own[1];
      const bool is_value = holds_value_[bin] != 0 && all > least;
      if ((is_value || all > 2 * least) && size[0] + size[1] > 0) {
        close(false);
      }
      bucket_[bin] = std::uint16_t(bucket);
      size[0] += own[0];
      size[1] += own[1];
      if (size[0] + size[1] >= least) {
        close(is_value);
      }
    }
    if (size[0] + size[1] > 0) {
      close(false);
    }
    buckets.count = bucket;
  }

  static constexpr double largest = 0x1.fffffffffffffp+1023;
  std::int64_t n_[2];
  std::int32_t least_;
  std::int32_t even_bins_;
  std::int32_t most_bins_;
  // By bin.
  std::int32_t bins_ = 0;
  std::int32_t first_bins_ = 0; // of the even scale
  std::int32_t* counts_[2];
  std::uint8_t* holds_value_; // 1 where all its numbers are equal
  std::uint16_t* crowd_of_;   // from 1; 0 where it is none
  std::uint16_t* bucket_;
  std::int32_t leaves_ = 0;      // bins that are not cut
  std::int32_t* leaf_;           // in order
  KsSplit* split_;               // where it is a crowd
  std::int32_t first_crowd_ = 0; // of the newest bins
  std::int32_t crowds_ = 0;
  Crowd* crowd_;
  bool by_exponent_ = false; // the newest crowds are cut so
  // Of the points that will be dealt.
  std::int32_t sampled_ = 0;
  double* sample_;
  std::uint16_t* bin_of_sample_;
  std::uint16_t* bin_;              // by point
  std::int64_t listed_[2] = {0, 0}; // end of those of each sample
  std::int32_t* point_;             // those of crowds
};

DRIFTWALK_LANES_END
