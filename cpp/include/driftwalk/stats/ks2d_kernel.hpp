// The sweep of the KS statistic on one instruction set.
//
// H(k), the weight of the points before point k in both orders, is a sum of three parts: the points
// in earlier blocks of both orders (`corner`, cumulative sums over blocks), those in the same block
// of x before k, and those in the same block of y but an earlier block of x. The last two are the
// same count, "how many elements of my block stand before me and have a smaller key", done for a
// vector of queries at a time. With the weights of the half planes, H gives all four quadrants.
#pragma once

#include "driftwalk/config.hpp"
#include "driftwalk/stats/ks2d_sweep.hpp"

#include <cstdint>
#include <limits>

DRIFTWALK_LANES_BEGIN

#if defined(__AVX512BW__)
inline constexpr int ks_vector_bytes = 64;
#elif defined(__AVX2__)
inline constexpr int ks_vector_bytes = 32;
#else
inline constexpr int ks_vector_bytes = 16;
#endif

// Room behind every array: the last vector of queries may reach beyond the last point.
inline constexpr std::int64_t ks_padding = 64;

template <class Key>
struct KsVector {
  static constexpr int lanes = ks_vector_bytes / int(sizeof(Key));
  typedef Key Type __attribute__((vector_size(ks_vector_bytes)));

  static Type load(const Key* from) {
    Type value;
    __builtin_memcpy(&value, from, sizeof value);
    return value;
  }
  static Type iota() {
    Type value{};
    for (int lane = 0; lane < lanes; ++lane) {
      value[lane] = Key(lane);
    }
    return value;
  }
};

// The points in one of the two orders, with the keys of the other: all of them as queries, and each
// sample by itself as elements to be counted.
template <class Key>
struct KsOrder {
  Key* query;              // (n + padding)
  Key* element[2];         // (points of the sample + padding)
  Key* lane[2];            // the element's place within its vector of queries
  std::int32_t* before[2]; // (vectors + 1) elements that stand before each vector of queries
};

template <class Key>
inline void ks_append(const KsOrder<Key>& order, std::int64_t position, Key key, int sample,
                      std::int32_t counts[2]) {
  constexpr int lanes = KsVector<Key>::lanes;
  if (position % lanes == 0) {
    order.before[0][position / lanes] = counts[0];
    order.before[1][position / lanes] = counts[1];
  }
  order.query[position] = key;
  const std::int32_t at = counts[sample];
  order.element[sample][at] = key;
  order.lane[sample][at] = Key(position % lanes);
  counts[sample] = at + 1;
}

template <class Key>
inline void ks_finish_order(const KsOrder<Key>& order, std::int64_t n,
                            const std::int32_t counts[2]) {
  constexpr int lanes = KsVector<Key>::lanes;
  const std::int64_t vectors = (n + lanes - 1) / lanes;
  order.before[0][vectors] = counts[0];
  order.before[1][vectors] = counts[1];
  constexpr Key below_all = std::numeric_limits<Key>::min();
  for (int lane = 0; lane < lanes; ++lane) {
    order.query[n + lane] = below_all; // a query that nothing stands below
  }
}

// For the queries of one vector: the elements of the block before the vector that have a smaller
// key, and those inside the vector that also stand to the left of the query.
template <class Key>
inline typename KsVector<Key>::Type ks_count(const KsOrder<Key>& order, int sample,
                                             std::int64_t block_vector, std::int64_t vector,
                                             typename KsVector<Key>::Type query) {
  using Vector = typename KsVector<Key>::Type;
  const Key* const element = order.element[sample];
  const Key* const lane = order.lane[sample];
  const Vector iota = KsVector<Key>::iota();
  Vector count{};
  std::int32_t i = order.before[sample][block_vector];
  for (; i < order.before[sample][vector]; ++i) {
    count -= (Vector)(Vector{} + element[i] < query);
  }
  for (; i < order.before[sample][vector + 1]; ++i) {
    count -= (Vector)((Vector{} + element[i] < query) & (Vector{} + lane[i] < iota));
  }
  return count;
}

// out[k] = weight of what ks_count counts, for the queries of one block [begin, end).
template <class Key, class Weight>
inline void ks_count_block(const KsOrder<Key>& order, std::int64_t begin, std::int64_t end,
                           const Weight weight[2], Weight* out) {
  constexpr int lanes = KsVector<Key>::lanes;
  for (std::int64_t k = begin; k < end; k += lanes) {
    const auto query = KsVector<Key>::load(order.query + k);
    const auto first = ks_count<Key>(order, 0, begin / lanes, k / lanes, query);
    const auto second = ks_count<Key>(order, 1, begin / lanes, k / lanes, query);
    for (int lane = 0; lane < lanes; ++lane) {
      out[k - begin + lane] = weight[0] * Weight(first[lane]) + weight[1] * Weight(second[lane]);
    }
  }
}

// What the y order contributes to a point.
template <class Weight>
struct KsRow {
  Weight strip; // points of its block of y before it, in earlier blocks of x
  Weight below; // weight of the points before it in y
};

template <class Weight>
struct KsCorners {
  Weight open;         // {x < X, y < Y}
  Weight column;       // {x = X, y < Y}
  Weight row;          // {y = Y, x < X}
  Weight equal;        // {x = X, y = Y}
  Weight left;         // {x < X}
  Weight left_closed;  // {x <= X}
  Weight below;        // {y < Y}
  Weight below_closed; // {y <= Y}
};

template <class Weight>
inline Weight ks_abs(Weight a) {
  return a < 0 ? -a : a;
}

// The four quadrants of one origin. The weights of all points add up to zero, so each quadrant is a
// combination of the corner sums and the half planes.
template <class Weight>
inline void ks_strict(const KsCorners<Weight>& c, Weight quadrant[4]) {
  quadrant[0] = ks_abs(c.open);
  quadrant[1] = ks_abs(Weight(c.below - c.open - c.column));
  quadrant[2] = ks_abs(Weight(c.left - c.open - c.row));
  quadrant[3] =
      ks_abs(Weight(c.open + c.column + c.row + c.equal - c.left_closed - c.below_closed));
}

template <class Weight>
inline void ks_limits(const KsCorners<Weight>& c, Weight quadrant[4]) {
  quadrant[0] = quadrant[1] = quadrant[2] = quadrant[3] = 0;
  for (int closed = 0; closed < 4; ++closed) {
    const bool in_x = (closed & 1) != 0;
    const bool in_y = (closed & 2) != 0;
    const Weight inside =
        c.open + (in_x ? c.column : 0) + (in_y ? c.row : 0) + (in_x && in_y ? c.equal : 0);
    const Weight left = in_x ? c.left_closed : c.left;
    const Weight below = in_y ? c.below_closed : c.below;
    const Weight values[4] = {inside, below - inside, left - inside, inside - left - below};
    for (int q = 0; q < 4; ++q) {
      const Weight value = ks_abs(values[q]);
      quadrant[q] = value > quadrant[q] ? value : quadrant[q];
    }
  }
}

template <class Weight>
inline void ks_keep_best(const Weight quadrant[4], std::int64_t position, KsBest& best) {
  const Weight lower = quadrant[0] > quadrant[1] ? quadrant[0] : quadrant[1];
  const Weight upper = quadrant[2] > quadrant[3] ? quadrant[2] : quadrant[3];
  const Weight value = lower > upper ? lower : upper;
  if (value > best.value) {
    int q = 0;
    while (quadrant[q] != value) {
      ++q;
    }
    best = {value, position, q};
  }
}

// One sweep. `Key` holds a position, `Weight` four times the sum of all positive weights.
template <class Key, class Weight, int block_bits>
class KsSweeper {
public:
  explicit KsSweeper(const KsSweep& sweep)
      : sweep_(sweep), weight_{Weight(sweep.weight[0]), Weight(sweep.weight[1])} {
    char* at = static_cast<char*>(sweep.scratch);
    const std::int64_t room = sweep.n + ks_padding;
    take_order(at, x_order_);
    take_order(at, y_order_);
    second_by_y_ = take<std::uint8_t>(at, room);
    x_block_by_y_ = take<Key>(at, room);
    rows_ = take<KsRow<Weight>>(at, room);
    strip_ = take<Weight>(at, block + ks_padding);
    blocks_ = (sweep.n + block - 1) / block;
    column_ = take<Weight>(at, blocks_ + 1);
    corner_ = take<Weight>(at, blocks_ + 1);
  }

  void run(KsBest best[2]) {
    best[0] = best[1] = {0, -1, -1};
    lay_out_x();
    lay_out_y();
    count_rows();
    for (std::int64_t b = 0; b <= blocks_; ++b) {
      column_[b] = 0;
    }
    Weight left = 0;
    for (std::int64_t b = 0; b < blocks_; ++b) {
      sweep_block(b * block, left, best);
    }
  }

private:
  static constexpr std::int64_t block = std::int64_t(1) << block_bits;

  template <class T>
  static T* take(char*& at, std::int64_t count) {
    T* const begin = reinterpret_cast<T*>(at);
    at += (count * std::int64_t(sizeof(T)) + 63) / 64 * 64;
    return begin;
  }

  void take_order(char*& at, KsOrder<Key>& order) const {
    const std::int64_t room = sweep_.n + ks_padding;
    order.query = take<Key>(at, room);
    for (int sample = 0; sample < 2; ++sample) {
      order.element[sample] = take<Key>(at, room);
      order.lane[sample] = take<Key>(at, room);
      order.before[sample] = take<std::int32_t>(at, sweep_.n / KsVector<Key>::lanes + 3);
    }
  }

  // Key of a position: shifted so that the whole range of a signed number is used.
  static Key key_of(std::int64_t position) {
    constexpr std::int64_t lowest = std::numeric_limits<Key>::min();
    return Key(position + lowest);
  }

  void lay_out_x() {
    std::int32_t counts[2] = {0, 0};
    for (std::int64_t k = 0; k < sweep_.n; ++k) {
      const std::int32_t y = sweep_.y_position[k];
      const int sample = sweep_.second[k];
      ks_append(x_order_, k, key_of(y), sample, counts);
      second_by_y_[y] = std::uint8_t(sample);
      x_block_by_y_[y] = Key(k >> block_bits);
    }
    ks_finish_order(x_order_, sweep_.n, counts);
  }

  void lay_out_y() {
    std::int32_t counts[2] = {0, 0};
    Weight below = 0;
    for (std::int64_t k = 0; k < sweep_.n; ++k) {
      const int sample = second_by_y_[k];
      ks_append(y_order_, k, x_block_by_y_[k], sample, counts);
      rows_[k].below = below;
      below += weight_[sample];
    }
    ks_finish_order(y_order_, sweep_.n, counts);
  }

  void count_rows() {
    for (std::int64_t begin = 0; begin < sweep_.n; begin += block) {
      const std::int64_t end = begin + block < sweep_.n ? begin + block : sweep_.n;
      ks_count_block<Key, Weight>(y_order_, begin, end, weight_, strip_);
      for (std::int64_t k = begin; k < end; ++k) {
        rows_[k].strip = strip_[k - begin];
      }
    }
  }

  void sweep_block(std::int64_t begin, Weight& left, KsBest best[2]) {
    const std::int64_t end = begin + block < sweep_.n ? begin + block : sweep_.n;
    ks_count_block<Key, Weight>(x_order_, begin, end, weight_, strip_);
    Weight sum = 0;
    for (std::int64_t b = 0; b < blocks_; ++b) {
      corner_[b] = sum;
      sum += column_[b];
    }
    if (sweep_.tied == nullptr && !sweep_.limits) {
      finish_untied(begin, end, left, best);
    } else {
      finish_tied(begin, end, left, best);
    }
    for (std::int64_t k = begin; k < end; ++k) {
      column_[sweep_.y_position[k] >> block_bits] += weight_[sweep_.second[k]];
    }
  }

  Weight open_quadrant(std::int64_t k, std::int64_t begin, const KsRow<Weight>& row) const {
    return corner_[sweep_.y_position[k] >> block_bits] + strip_[k - begin] + row.strip;
  }

  void finish_untied(std::int64_t begin, std::int64_t end, Weight& left, KsBest best[2]) const {
    for (std::int64_t k = begin; k < end; ++k) {
      const int sample = sweep_.second[k];
      const Weight own = weight_[sample];
      const KsRow<Weight> row = rows_[sweep_.y_position[k]];
      const Weight open = open_quadrant(k, begin, row);
      const Weight quadrant[4] = {ks_abs(open), ks_abs(Weight(row.below - open)),
                                  ks_abs(Weight(left - open)),
                                  ks_abs(Weight(open - left - row.below - own))};
      ks_keep_best(quadrant, k, best[sample]);
      left += own;
    }
  }

  void finish_tied(std::int64_t begin, std::int64_t end, Weight& left, KsBest best[2]) const {
    for (std::int64_t k = begin; k < end; ++k) {
      const int sample = sweep_.second[k];
      const Weight own = weight_[sample];
      const KsRow<Weight> row = rows_[sweep_.y_position[k]];
      const Weight open = open_quadrant(k, begin, row);
      KsCorners<Weight> corners{open, 0, 0, own, left, left + own, row.below, row.below + own};
      if (sweep_.tied != nullptr) {
        const KsTied& t = sweep_.tied[k];
        corners = {open,           Weight(t.column),      Weight(t.row),   Weight(t.equal),
                   Weight(t.left), Weight(t.left_closed), Weight(t.below), Weight(t.below_closed)};
      }
      Weight quadrant[4];
      if (sweep_.limits) {
        ks_limits(corners, quadrant);
      } else {
        ks_strict(corners, quadrant);
      }
      ks_keep_best(quadrant, k, best[sample]);
      left += own;
    }
  }

  KsSweep sweep_;
  Weight weight_[2];
  KsOrder<Key> x_order_;
  KsOrder<Key> y_order_;
  std::uint8_t* second_by_y_;
  Key* x_block_by_y_;
  KsRow<Weight>* rows_;
  Weight* strip_;
  Weight* column_;
  Weight* corner_;
  std::int64_t blocks_;
};

DRIFTWALK_LANES_END
