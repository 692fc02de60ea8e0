// The KS statistic of two samples as they come, on one instruction set.
//
// Both axes are cut into buckets, columns of x and rows of y. What lies before the column and the
// row of an origin is known from one pass over the rows. The points that share its column or its
// row are few, and bound how far each quadrant can be from that. Only origins whose bound reaches
// the largest difference are counted, coordinate by coordinate: a few in a thousand. As the
// coordinates themselves are compared, ties need no order.
#pragma once

#include "driftwalk/config.hpp"
#include "driftwalk/stats/ks2d_buckets.hpp"
#include "driftwalk/stats/ks2d_kernel.hpp"
#include "driftwalk/stats/ks2d_sweep.hpp"
#include "driftwalk/stats/ks2d_tied.hpp"

#include <cstdint>

DRIFTWALK_LANES_BEGIN

// Weights of columns, with the sum before every column at hand. Columns stand in groups; the sums
// within a group are kept by every addition, the sums of groups are made by `sum`.
template <class Weight>
class KsColumnSums {
public:
  KsColumnSums(char*& scratch, std::int64_t columns)
      : groups_(columns / group + 1), within_(ks_take<Weight>(scratch, groups_ * group)),
        group_(ks_take<Weight>(scratch, groups_)), before_(ks_take<Weight>(scratch, groups_)) {
    for (std::int64_t i = 0; i < groups_ * group; ++i) {
      within_[i] = 0;
    }
    for (std::int64_t i = 0; i < groups_; ++i) {
      group_[i] = before_[i] = 0;
    }
  }

  // Of the columns before; may be asked of the end too.
  Weight before(std::int64_t column) const { return before_[column / group] + within_[column]; }

  void add(std::int64_t column, Weight weight) {
    using Vector = KsVector<Weight>;
    // As many zeros as there are columns up to this one, then ones.
    static constexpr Weight masks[2 * group] = {0,  0,  0,  0,  0,  0,  0,  0,  0,  0,  0,
                                                0,  0,  0,  0,  0,  -1, -1, -1, -1, -1, -1,
                                                -1, -1, -1, -1, -1, -1, -1, -1, -1, -1};
    const std::int64_t place = column % group;
    Weight* const sums = within_ + (column - place);
    for (int i = 0; i < group; i += Vector::lanes) {
      Vector::store(sums + i, Vector::load(sums + i) +
                                  (Vector::load(masks + group - 1 - place + i) & weight));
    }
    group_[column / group] += weight;
  }

  void sum() {
    Weight sum = 0;
    for (std::int64_t i = 0; i < groups_; ++i) {
      before_[i] = sum;
      sum += group_[i];
    }
  }

private:
  static constexpr int group = 16;
  std::int64_t groups_;
  Weight* within_; // by column: of the columns of its group before it
  Weight* group_;
  Weight* before_; // by group
};

template <class Weight>
class KsBounded {
public:
  explicit KsBounded(const KsPlain& samples)
      : samples_(samples), n_(samples.n[0] + samples.n[1]),
        weight_{Weight(samples.weight[0]), Weight(samples.weight[1])},
        at_(static_cast<char*>(samples.scratch)) {
    take_buckets(columns_);
    take_buckets(rows_);
    tied_ = ks_take<std::uint8_t>(at_, n_);
    lists_ = at_;
    in_column_ = ks_take<KsRecord>(at_, n_);
    in_row_ = ks_take<KsRecord>(at_, n_);
    bound_ = ks_take<Weight>(at_, n_);
    corner_ = ks_take<Weight>(at_, n_);
    of_column_ = {ks_take<double>(at_, n_ + ks_padding), ks_take<double>(at_, n_ + ks_padding)};
    of_row_ = {ks_take<double>(at_, n_ + ks_padding), ks_take<double>(at_, n_ + ks_padding)};
  }

  bool run(KsFound found[2], std::int64_t& tied) {
    for (std::int64_t i = 0; i < n_; ++i) {
      tied_[i] = 0;
    }
    KsBucketer bucketer(samples_.n, samples_.buckets, lists_);
    if (!bucketer.cut(samples_.x, columns_) || !bucketer.cut(samples_.y, rows_)) {
      return false;
    }
    order_points(rows_, columns_, samples_.y, in_row_);
    order_points(columns_, rows_, samples_.x, in_column_);
    weigh_columns();
    bound_all();
    if (!count_candidates()) {
      return false;
    }
    for (int sample = 0; sample < 2; ++sample) {
      found[sample] = found_[sample];
    }
    tied =
        samples_.most_tied > 0
            ? KsTiedCounter(samples_, {columns_, in_column_}, {rows_, in_row_}, tied_, at_).count()
            : 0;
    return true;
  }

private:
  struct Pair {
    double* first;
    double* second;
  };
  // What is known of a column before the rows are met.
  struct Column {
    Weight left; // weight of the columns before
    Weight slack;
  };

  void take_buckets(KsBuckets& buckets) {
    const std::int64_t most = samples_.buckets.most;
    buckets.of_point = ks_take<std::uint16_t>(at_, n_);
    buckets.size[0] = ks_take<std::int32_t>(at_, most + 1);
    buckets.size[1] = ks_take<std::int32_t>(at_, most + 1);
    buckets.is_value = ks_take<std::uint8_t>(at_, most);
    buckets.begin = ks_take<std::int32_t>(at_, most + 1);
  }

  static Weight slack_of(const KsBuckets& buckets, std::int64_t bucket, const Weight weight[2]) {
    // Where all numbers are equal none of the points lies in an open quadrant of another.
    return buckets.is_value[bucket] != 0
               ? Weight(0)
               : ks_larger(Weight(weight[0] * Weight(buckets.size[0][bucket])),
                           Weight(-weight[1] * Weight(buckets.size[1][bucket])));
  }
  static Weight weight_of(const KsBuckets& buckets, std::int64_t bucket, const Weight weight[2]) {
    return weight[0] * Weight(buckets.size[0][bucket]) +
           weight[1] * Weight(buckets.size[1][bucket]);
  }

  // The points of each bucket in a line; in it those of sample 1 come first.
  void order_points(const KsBuckets& axis, const KsBuckets& other, const double* const values[2],
                    KsRecord* records) {
    constexpr std::int64_t ahead = 32;
    std::int32_t* const next = ks_take_later<std::int32_t>(axis.count);
    for (std::int64_t b = 0; b < axis.count; ++b) {
      next[b] = axis.begin[b];
    }
    std::uint32_t point = 0;
    for (int sample = 0; sample < 2; ++sample) {
      for (std::int64_t i = 0; i < samples_.n[sample]; ++i, ++point) {
        // Where a later point goes was last written to long ago.
        const std::int64_t later = point + ahead < n_ ? point + ahead : point;
        __builtin_prefetch(records + next[axis.of_point[later]], 1);
        records[next[axis.of_point[point]]++] =
            KsRecord(point, other.of_point[point], values[sample][i]);
      }
    }
  }

  // Scratch that is free after the buckets were cut, until it is asked for again.
  template <class T>
  T* ks_take_later(std::int64_t count) const {
    char* at = at_;
    return ks_take<T>(at, count);
  }

  void weigh_columns() {
    known_ = ks_take<Column>(at_, columns_.count + 1);
    is_ready_ = ks_take<std::uint8_t>(at_, columns_.count);
    is_row_ready_ = ks_take<std::uint8_t>(at_, rows_.count);
    below_ = ks_take<Weight>(at_, rows_.count + 1);
    Weight left = 0;
    for (std::int64_t c = 0; c < columns_.count; ++c) {
      known_[c] = {left, slack_of(columns_, c, weight_)};
      left += weight_of(columns_, c, weight_);
      is_ready_[c] = 0;
    }
    known_[columns_.count] = {left, 0};
    Weight below = 0;
    for (std::int64_t r = 0; r < rows_.count; ++r) {
      is_row_ready_[r] = 0;
      below_[r] = below;
      below += weight_of(rows_, r, weight_);
    }
    below_[rows_.count] = below;
  }

  void bound_all() {
    char* scratch = at_;
    KsColumnSums<Weight> sums(scratch, columns_.count + 1);
    for (std::int64_t r = 0; r < rows_.count; ++r) {
      const std::int64_t begin = rows_.begin[r];
      const std::int64_t middle = begin + rows_.size[0][r];
      const std::int64_t end = rows_.begin[r + 1];
      if (rows_.is_value[r] == 0) {
        bound_row<false>(sums, r, begin, middle, 0);
        bound_row<false>(sums, r, middle, end, 1);
      } else {
        bound_lower_half(sums, r, begin, end);
      }
      for (std::int64_t k = begin; k < middle; ++k) {
        sums.add(in_row_[k].bucket(), weight_[0]);
      }
      for (std::int64_t k = middle; k < end; ++k) {
        sums.add(in_row_[k].bucket(), weight_[1]);
      }
      sums.sum();
      if (rows_.is_value[r] != 0) {
        bound_row<true>(sums, r, begin, middle, 0);
        bound_row<true>(sums, r, middle, end, 1);
      }
    }
  }

  // The lower quadrants of a row of one value; the upper ones need the row itself among the sums.
  void bound_lower_half(const KsColumnSums<Weight>& sums, std::int64_t r, std::int64_t begin,
                        std::int64_t end) {
    for (std::int64_t k = begin; k < end; ++k) {
      const std::int32_t c = in_row_[k].bucket();
      const Weight before = sums.before(c);
      const Weight through = sums.before(c + 1);
      corner_[k] = before;
      bound_[k] = ks_larger(ks_abs(before), ks_abs(Weight(below_[r] - through)));
    }
  }

  template <bool is_value>
  void bound_row(const KsColumnSums<Weight>& sums, std::int64_t r, std::int64_t begin,
                 std::int64_t end, int sample) {
    const Weight slack_of_row = slack_of(rows_, r, weight_);
    const Weight below = is_value ? below_[r + 1] : below_[r];
    Weight surely = surely_[sample];
    for (std::int64_t k = begin; k < end; ++k) {
      const std::int32_t c = in_row_[k].bucket();
      const Weight before = sums.before(c);
      const Weight through = sums.before(c + 1);
      const Column& known = known_[c];
      Weight value = ks_larger(ks_abs(Weight(known.left - before)),
                               ks_abs(Weight(through - known_[c + 1].left - below)));
      if (is_value) {
        value = ks_larger(value, bound_[k]);
      } else {
        corner_[k] = before;
        value = ks_larger(value, ks_larger(ks_abs(before), ks_abs(Weight(below - through))));
      }
      const Weight slack = known.slack + slack_of_row;
      bound_[k] = value + slack;
      surely = ks_larger(surely, Weight(value - slack));
    }
    surely_[sample] = surely;
  }

  // Count the origins whose bounds reach what is found or known to be there. False where there are
  // so many that the sweep takes less time.
  bool count_candidates() {
    constexpr std::int64_t most_looks = 16; // for each point; measured
    char* scratch = at_;
    std::int32_t* const candidate = ks_take<std::int32_t>(scratch, n_);
    std::int32_t* const row_met = ks_take<std::int32_t>(scratch, columns_.count);
    std::int64_t count = 0;
    Weight highest[2] = {surely_[0], surely_[1]};
    for (int sample = 0; sample < 2; ++sample) {
      for (std::int64_t c = 0; c < columns_.count; ++c) {
        row_met[c] = -1;
      }
      for (std::int64_t r = 0; r < rows_.count; ++r) {
        const std::int64_t begin = rows_.begin[r] + (sample == 0 ? 0 : rows_.size[0][r]);
        const std::int64_t end = begin + rows_.size[sample][r];
        for (std::int64_t k = end - 1; k >= begin; --k) {
          candidate[count] = std::int32_t(k);
          count += bound_[k] >= surely_[sample] && !is_met(k, r, row_met);
          highest[sample] = ks_larger(highest[sample], bound_[k]);
        }
      }
    }
    std::int64_t looks_left = most_looks * n_;
    // The most promising first: they spare most of the others.
    for (int part = 3; part >= 0; --part) {
      Weight from[2];
      for (int sample = 0; sample < 2; ++sample) {
        from[sample] = surely_[sample] + (highest[sample] - surely_[sample]) / 4 * Weight(part);
      }
      for (std::int64_t i = 0; i < count; ++i) {
        const KsRecord record = in_row_[candidate[i]];
        const Weight bound = bound_[candidate[i]];
        const int sample = record.point() >= samples_.n[0];
        if (bound >= Weight(found_[sample].value) && bound >= from[sample]) {
          looks_left -= looks(record.bucket(), rows_.of_point[record.point()]);
        }
      }
      if (looks_left < 0) {
        return false;
      }
      std::int64_t kept = 0;
      for (std::int64_t i = 0; i < count; ++i) {
        const std::int32_t k = candidate[i];
        const int sample = in_row_[k].point() >= samples_.n[0];
        if (bound_[k] < from[sample]) {
          candidate[kept++] = k;
        } else if (bound_[k] >= Weight(found_[sample].value)) {
          count_origin(k, sample);
        }
      }
      count = kept;
    }
    return true;
  }

  // Whether a point of the same sample and the same two numbers was met before; it is the later one
  // of the sample. Known where the column and the row have one number each.
  bool is_met(std::int64_t k, std::int64_t r, std::int32_t* row_met) const {
    const std::int32_t c = in_row_[k].bucket();
    if (rows_.is_value[r] == 0 || columns_.is_value[c] == 0) {
      return false;
    }
    const bool is_met = row_met[c] == r;
    row_met[c] = std::int32_t(r);
    return is_met;
  }

  // Points that an origin of a column and a row is compared with.
  std::int64_t looks(std::int64_t c, std::int64_t r) const {
    return columns_.begin[c + 1] - columns_.begin[c] + rows_.begin[r + 1] - rows_.begin[r];
  }

  // Numbers of points of both samples, each in one half of an integer, for a vector of points.
  using Counts = KsVector<std::int64_t>;
  Weight weight_of(typename Counts::Type counts) const {
    std::int64_t sum = 0;
    for (int lane = 0; lane < Counts::lanes; ++lane) {
      sum += counts[lane];
    }
    return weight_[0] * Weight(sum & 0xFFFFFFFF) + weight_[1] * Weight(sum >> 32);
  }

  // Call with every vector of points of a bucket: two numbers of each point, and what it counts.
  template <class Call>
  static void for_points(const KsBuckets& buckets, std::int64_t bucket, const Pair& numbers,
                         Call call) {
    const std::int64_t begin = buckets.begin[bucket];
    const std::int64_t middle = buckets.size[0][bucket];
    const std::int64_t end = middle + buckets.size[1][bucket];
    for (std::int64_t i = 0; i < end; i += Counts::lanes) {
      const typename Counts::Type place = Counts::iota() + i;
      const typename Counts::Type one =
          (((typename Counts::Type)(place < middle) & 1) |
           ((typename Counts::Type)(place >= middle) & (std::int64_t(1) << 32))) &
          (typename Counts::Type)(place < end);
      call(KsVector<double>::load(numbers.first + begin + i),
           KsVector<double>::load(numbers.second + begin + i), one);
    }
  }

  // All four quadrants of the k-th origin in the order of rows.
  void count_origin(std::int64_t k, int sample) {
    using Numbers = typename KsVector<double>::Type;
    using Vector = typename Counts::Type;
    const std::int32_t point = in_row_[k].point();
    const std::int32_t c = in_row_[k].bucket();
    const std::int32_t r = rows_.of_point[point];
    const std::int64_t row = sample == 0 ? point : point - samples_.n[0];
    const double origin_x = samples_.x[sample][row];
    const double origin_y = samples_.y[sample][row];
    make_ready(c, r);
    Vector left{}, left_closed{}, open{}, closed_in_x{}, closed_in_y{}, closed{};
    for_points(columns_, c, of_column_, [&](Numbers x, Numbers y, Vector one) {
      const Vector is_left = (Vector)(x < origin_x) & one;
      const Vector not_right = (Vector)(x <= origin_x) & one;
      const Vector is_below = (Vector)(y < origin_y);
      const Vector not_above = (Vector)(y <= origin_y);
      left += is_left;
      left_closed += not_right;
      open += is_left & is_below;
      closed_in_x += not_right & is_below;
      closed_in_y += is_left & not_above;
      closed += not_right & not_above;
    });
    // Points of the row in earlier columns lie to the left.
    Vector below{}, below_closed{}, left_below{}, left_not_above{};
    const double own_column = c;
    for_points(rows_, r, of_row_, [&](Numbers y, Numbers column, Vector one) {
      const Vector is_below = (Vector)(y < origin_y) & one;
      const Vector not_above = (Vector)(y <= origin_y) & one;
      const Vector is_left = (Vector)(column < own_column);
      below += is_below;
      below_closed += not_above;
      left_below += is_below & is_left;
      left_not_above += not_above & is_left;
    });
    const Weight corner = corner_[k];
    const KsCorners<Weight> corners{Weight(corner + weight_of(left_below + open)),
                                    weight_of(closed_in_x - open),
                                    weight_of(left_not_above - left_below + closed_in_y - open),
                                    weight_of(closed - closed_in_x - closed_in_y + open),
                                    Weight(known_[c].left + weight_of(left)),
                                    Weight(known_[c].left + weight_of(left_closed)),
                                    Weight(below_[r] + weight_of(below)),
                                    Weight(below_[r] + weight_of(below_closed))};
    Weight quadrant[4];
    ks_strict(corners, quadrant);
    keep(quadrant, row, sample);
  }

  // Of equal ones the first in the order of x, then the highest, then the last of its sample.
  void keep(const Weight quadrant[4], std::int64_t row, int sample) {
    KsFound& found = found_[sample];
    const std::int64_t value = ks_largest(quadrant);
    if (value < found.value || value == 0) {
      return;
    }
    if (value == found.value) {
      const double* const x = samples_.x[sample];
      const double* const y = samples_.y[sample];
      const std::int64_t other = found.row;
      const bool first = x[row] != x[other]   ? x[row] < x[other]
                         : y[row] != y[other] ? y[row] > y[other]
                                              : row > other;
      if (!first) {
        return;
      }
    }
    int q = 0;
    while (quadrant[q] != value) {
      ++q;
    }
    found = {value, row, q};
  }

  // The numbers of a column and of a row, where they are not at hand yet.
  void make_ready(std::int64_t c, std::int64_t r) {
    if (is_ready_[c] == 0) {
      is_ready_[c] = 1;
      for (std::int64_t k = columns_.begin[c]; k < columns_.begin[c + 1]; ++k) {
        of_column_.first[k] = in_column_[k].value(samples_.x, samples_.n[0]);
        of_column_.second[k] = in_column_[k].value(samples_.y, samples_.n[0]);
      }
    }
    if (is_row_ready_[r] == 0) {
      is_row_ready_[r] = 1;
      for (std::int64_t k = rows_.begin[r]; k < rows_.begin[r + 1]; ++k) {
        of_row_.first[k] = in_row_[k].value(samples_.y, samples_.n[0]);
        of_row_.second[k] = in_row_[k].bucket();
      }
    }
  }

  KsPlain samples_;
  std::int64_t n_;
  Weight weight_[2];
  char* at_; // where free scratch begins
  KsBuckets columns_{};
  KsBuckets rows_{};
  std::uint8_t* tied_; // by point: 1 where it is known to share a coordinate
  char* lists_;        // where the lists below begin; scratch until they are filled
  // In the order of columns.
  KsRecord* in_column_;
  Pair of_column_; // x and y, where the column is ready
  // In the order of rows.
  KsRecord* in_row_;
  Pair of_row_;    // y and column, where the row is ready
  Weight* bound_;  // no quadrant of the origin holds more
  Weight* corner_; // weight of the columns and rows before those of the origin
  // By column, by row.
  Column* known_ = nullptr;
  std::uint8_t* is_ready_ = nullptr;
  std::uint8_t* is_row_ready_ = nullptr;
  Weight* below_ = nullptr;
  Weight surely_[2] = {0, 0}; // some origin of the sample has at least this
  KsFound found_[2] = {{0, -1, -1}, {0, -1, -1}};
};

DRIFTWALK_LANES_END
