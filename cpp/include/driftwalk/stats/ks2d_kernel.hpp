// The sweep of the KS statistic on one instruction set.
//
// Both orders are cut into blocks: of y ("rows") and of x ("columns"). H, the weight of the points
// before a point in both orders, is a sum of three parts: the points in earlier blocks of both
// orders (`corner`, cumulative sums over columns), those in the same column and not above, and
// those in the same row but an earlier column. The last two are the same count, "how many elements
// of my block stand before me and have a smaller key", done for a vector of queries at a time. With
// the weights of the half planes, H gives all four quadrants.
//
// The sweep never jumps about in memory. It deals the points to their columns in the order of y,
// so that each column fills from its beginning, and collects what it counted there in the same
// order.
#pragma once

#include "driftwalk/config.hpp"
#include "driftwalk/stats/ks2d_sweep.hpp"

#include <cstdint>
#include <limits>
#include <type_traits>

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
  static void store(Key* to, Type value) { __builtin_memcpy(to, &value, sizeof value); }
  static Type iota() {
    Type value{};
    for (int lane = 0; lane < lanes; ++lane) {
      value[lane] = Key(lane);
    }
    return value;
  }
};

// Key of a number: shifted so that the whole range of a signed type is used.
template <class Key>
inline Key ks_key(std::int64_t number) {
  constexpr std::int64_t lowest = std::numeric_limits<Key>::min();
  return Key(number + lowest);
}
template <class Key>
inline std::int64_t ks_number(Key key) {
  constexpr std::int64_t lowest = std::numeric_limits<Key>::min();
  return std::int64_t(key) - lowest;
}

// The points of one block: each sample by itself as elements to be counted, and the counts.
template <class Key>
struct KsBlock {
  using Count = std::make_unsigned_t<Key>; // reaches beyond the largest key
  struct Element {
    Key key;
    Key lane; // its place within its vector of queries
  };
  Element* element[2];
  std::int32_t* before[2]; // (vectors + 1) elements that stand before each vector of queries
  Count* count[2];         // for each query
};

// Divide the points between the samples; second_of(i) tells the sample of the i-th.
template <class Key, class Second>
inline void ks_divide(const KsBlock<Key>& block, const Key* query, std::int64_t size,
                      Second second_of) {
  constexpr std::int64_t lanes = KsVector<Key>::lanes;
  std::int32_t ends[2] = {0, 0};
  for (std::int64_t begin = 0; begin < size; begin += lanes) {
    block.before[0][begin / lanes] = ends[0];
    block.before[1][begin / lanes] = ends[1];
    const std::int64_t end = begin + lanes < size ? begin + lanes : size;
    for (std::int64_t i = begin; i < end; ++i) {
      // Written to both, kept in one: no branch on what is a coin toss.
      const std::int32_t second = second_of(i);
      const typename KsBlock<Key>::Element element{query[i], Key(i - begin)};
      block.element[0][ends[0]] = element;
      block.element[1][ends[1]] = element;
      ends[0] += 1 - second;
      ends[1] += second;
    }
  }
  const std::int64_t vectors = (size + lanes - 1) / lanes;
  block.before[0][vectors] = ends[0];
  block.before[1][vectors] = ends[1];
}

// For the queries of one vector: the elements before the vector that have a smaller key, and those
// inside the vector that also stand to the left of the query.
template <class Key>
inline typename KsVector<std::make_unsigned_t<Key>>::Type
ks_count(const KsBlock<Key>& block, int sample, std::int64_t vector,
         typename KsVector<Key>::Type query) {
  using Vector = typename KsVector<Key>::Type;
  const typename KsBlock<Key>::Element* const element = block.element[sample];
  const Vector iota = KsVector<Key>::iota();
  using Counts = typename KsVector<typename KsBlock<Key>::Count>::Type;
  Counts count{};
  std::int32_t i = 0;
  for (; i < block.before[sample][vector]; ++i) {
    count -= (Counts)(Vector{} + element[i].key < query);
  }
  for (; i < block.before[sample][vector + 1]; ++i) {
    count -= (Counts)((Vector{} + element[i].key < query) & (Vector{} + element[i].lane < iota));
  }
  return count;
}

// Weight of what ks_count counts, for every query of a block.
template <class Key, class Weight>
inline void ks_weigh(const KsBlock<Key>& block, const Key* query, std::int64_t size,
                     const Weight weight[2], Weight* out) {
  using Count = typename KsBlock<Key>::Count;
  constexpr std::int64_t lanes = KsVector<Key>::lanes;
  for (std::int64_t begin = 0; begin < size; begin += lanes) {
    const auto queries = KsVector<Key>::load(query + begin);
    for (int sample = 0; sample < 2; ++sample) {
      KsVector<Count>::store(block.count[sample] + begin,
                             ks_count<Key>(block, sample, begin / lanes, queries));
    }
  }
  for (std::int64_t i = 0; i < size; ++i) {
    out[i] =
        weight[0] * Weight(Count(block.count[0][i])) + weight[1] * Weight(Count(block.count[1][i]));
  }
}

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

template <class Weight>
inline Weight ks_larger(Weight a, Weight b) {
  return a > b ? a : b;
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
      quadrant[q] = ks_larger(ks_abs(values[q]), quadrant[q]);
    }
  }
}

template <class Weight>
inline Weight ks_largest(const Weight quadrant[4]) {
  return ks_larger(ks_larger(quadrant[0], quadrant[1]), ks_larger(quadrant[2], quadrant[3]));
}

template <class Weight>
inline void ks_keep_best(const Weight quadrant[4], std::int64_t position, KsBest& best) {
  const Weight value = ks_largest(quadrant);
  if (value > best.value || (value == best.value && value > 0 && position < best.position)) {
    int q = 0;
    while (quadrant[q] != value) {
      ++q;
    }
    best = {value, position, q};
  }
}

// One sweep. `Place` holds a place within a block, `Column` the number of a column, `Weight` four
// times the sum of all positive weights.
template <class Place, class Column, class Weight, int block_bits>
class KsSweeper {
public:
  explicit KsSweeper(const KsSweep& sweep)
      : sweep_(sweep), weight_{Weight(sweep.weight[0]), Weight(sweep.weight[1])},
        columns_((sweep.n + block_size - 1) / block_size) {
    static_assert((std::int64_t(1) << (8 * sizeof(Place))) >= block_size);
    char* at = static_cast<char*>(sweep.scratch);
    place_ = take<Place>(at, sweep.n + ks_padding);
    counted_ = take<Counted>(at, sweep.n);
    next_ = take<std::int32_t>(at, columns_);
    while ((std::int64_t(lanes) << run_bits_) < columns_) {
      ++run_bits_;
    }
    slots_ = std::int64_t(lanes) << run_bits_;
    column_ = take<Weight>(at, slots_);
    corner_ = take<Weight>(at, slots_);
    take_block(at, by_place_);
    take_block(at, by_column_);
    column_of_ = take<Column>(at, room);
    slot_ = take<std::int32_t>(at, block_size);
    left_ = take<Weight>(at, block_size);
    strip_ = take<Weight>(at, block_size);
    origins_ = {take<Counted>(at, block_size), take<Weight>(at, block_size),
                take<Weight>(at, block_size)};
  }

  void run(KsBest best[2]) {
    best[0] = best[1] = {0, -1, -1};
    deal();
    Weight left = 0;
    for (std::int64_t begin = 0; begin < sweep_.n; begin += block_size) {
      count_in_column(begin, left);
    }
    rewind();
    for (std::int64_t slot = 0; slot < slots_; ++slot) {
      column_[slot] = 0;
    }
    Weight below = 0;
    for (std::int64_t begin = 0; begin < sweep_.n; begin += block_size) {
      sweep_row(begin, below, best);
    }
  }

private:
  static constexpr std::int64_t block_size = std::int64_t(1) << block_bits;
  static constexpr std::int64_t room = block_size + ks_padding;
  using Weights = KsVector<Weight>;
  static constexpr int lanes = Weights::lanes;

  // What a column tells of one of its points.
  struct Counted {
    Weight strip; // points of the column before it in both orders
    Weight left;  // points before it in the order of x
  };
  // The origins of one row.
  struct Origins {
    Counted* counted;
    Weight* open;
    Weight* below;
  };

  template <class T>
  static T* take(char*& at, std::int64_t count) {
    T* const begin = reinterpret_cast<T*>(at);
    at += (count * std::int64_t(sizeof(T)) + 63) / 64 * 64;
    return begin;
  }

  template <class Key>
  static void take_block(char*& at, KsBlock<Key>& block) {
    for (int sample = 0; sample < 2; ++sample) {
      block.element[sample] = take<typename KsBlock<Key>::Element>(at, room);
      block.before[sample] = take<std::int32_t>(at, block_size / KsVector<Key>::lanes + 2);
      block.count[sample] = take<typename KsBlock<Key>::Count>(at, room);
    }
  }

  std::int64_t size_from(std::int64_t begin) const {
    return begin + block_size < sweep_.n ? block_size : sweep_.n - begin;
  }

  void rewind() {
    for (std::int64_t c = 0; c < columns_; ++c) {
      next_[c] = std::int32_t(c << block_bits);
    }
  }

  // Give every column the places of its points, in the order of y.
  void deal() {
    rewind();
    for (std::int64_t k = 0; k < sweep_.n; ++k) {
      const std::int32_t x = sweep_.x_position[k];
      place_[next_[x >> block_bits]++] = ks_key<Place>(x & (block_size - 1));
    }
  }

  void count_in_column(std::int64_t begin, Weight& left) {
    const std::int64_t size = size_from(begin);
    const std::uint8_t* const second = sweep_.second_by_x + begin;
    for (std::int64_t i = 0; i < size; ++i) {
      left_[i] = left;
      left += weight_[second[i]];
    }
    const Place* const place = place_ + begin;
    ks_divide(by_place_, place, size,
              [=](std::int64_t i) { return std::int32_t(second[ks_number(place[i])]); });
    ks_weigh(by_place_, place, size, weight_, strip_);
    for (std::int64_t i = 0; i < size; ++i) {
      counted_[begin + i] = {strip_[i], left_[ks_number(place[i])]};
    }
  }

  void sweep_row(std::int64_t begin, Weight& below, KsBest best[2]) {
    const std::int64_t size = size_from(begin);
    const std::int32_t* const x = sweep_.x_position + begin;
    const std::uint8_t* const second = sweep_.second_by_y + begin;
    for (std::int64_t i = 0; i < size; ++i) {
      const std::int32_t column = x[i] >> block_bits;
      column_of_[i] = ks_key<Column>(column);
      slot_[i] = slot_of(column);
    }
    ks_divide(by_column_, column_of_, size,
              [=](std::int64_t i) { return std::int32_t(second[i]); });
    ks_weigh(by_column_, column_of_, size, weight_, strip_);
    sum_columns();
    for (std::int64_t i = 0; i < size; ++i) {
      const Counted* const next = counted_ + next_[x[i] >> block_bits]++;
      __builtin_prefetch(next + 64 / sizeof(Counted)); // for a later point of the column
      origins_.counted[i] = *next;
      origins_.open[i] = corner_[slot_[i]];
    }
    for (std::int64_t i = 0; i < size; ++i) {
      origins_.below[i] = below;
      below += weight_[second[i]];
    }
    for (std::int64_t i = 0; i < size; ++i) {
      origins_.open[i] += strip_[i] + origins_.counted[i].strip;
    }
    finish_row(begin, size, best);
    for (std::int64_t i = 0; i < size; ++i) {
      column_[slot_[i]] += weight_[second[i]];
    }
  }

  // Where a column stands in column_ and corner_: the columns are cut into as many runs as there
  // are lanes, and a run is a lane, so that the sums are made for all runs at once.
  std::int32_t slot_of(std::int32_t column) const {
    const std::int32_t lane = column >> run_bits_;
    return (column - (lane << run_bits_)) * lanes + lane;
  }

  void sum_columns() {
    typename Weights::Type sums{};
    for (std::int64_t slot = 0; slot < slots_; slot += lanes) {
      Weights::store(corner_ + slot, sums);
      sums += Weights::load(column_ + slot);
    }
    typename Weights::Type of_earlier_runs{};
    for (int lane = 1; lane < lanes; ++lane) {
      of_earlier_runs[lane] = of_earlier_runs[lane - 1] + sums[lane - 1];
    }
    for (std::int64_t slot = 0; slot < slots_; slot += lanes) {
      Weights::store(corner_ + slot, Weights::load(corner_ + slot) + of_earlier_runs);
    }
  }

  // The four quadrants of the i-th origin of a row.
  void untied_quadrants(std::int64_t i, Weight own, Weight quadrant[4]) const {
    const Weight open = origins_.open[i];
    const Weight left = origins_.counted[i].left;
    const Weight below = origins_.below[i];
    quadrant[0] = ks_abs(open);
    quadrant[1] = ks_abs(Weight(below - open));
    quadrant[2] = ks_abs(Weight(left - open));
    quadrant[3] = ks_abs(Weight(open - left - below - own));
  }

  template <bool limits>
  void quadrants(std::int64_t k, std::int64_t i, Weight own, Weight quadrant[4]) const {
    const Weight open = origins_.open[i];
    const Weight left = origins_.counted[i].left;
    const Weight below = origins_.below[i];
    KsCorners<Weight> corners{open, 0, 0, own, left, left + own, below, below + own};
    if (sweep_.tied_in_x != nullptr) {
      const KsTiedInX& in_x = sweep_.tied_in_x[sweep_.x_position[k]];
      const KsTiedInY& in_y = sweep_.tied_in_y[k];
      corners = {open,
                 Weight(in_x.column),
                 Weight(in_y.row),
                 Weight(in_x.equal),
                 Weight(in_x.left),
                 Weight(in_x.left_closed),
                 Weight(in_y.below),
                 Weight(in_y.below_closed)};
    }
    if (limits) {
      ks_limits(corners, quadrant);
    } else {
      ks_strict(corners, quadrant);
    }
  }

  void finish_row(std::int64_t begin, std::int64_t size, KsBest best[2]) const {
    if (sweep_.limits) {
      keep_best(begin, size, best, [=, this](std::int64_t i, Weight own, Weight quadrant[4]) {
        quadrants<true>(begin + i, i, own, quadrant);
      });
    } else if (sweep_.tied_in_x != nullptr) {
      keep_best(begin, size, best, [=, this](std::int64_t i, Weight own, Weight quadrant[4]) {
        quadrants<false>(begin + i, i, own, quadrant);
      });
    } else {
      keep_best(begin, size, best, [this](std::int64_t i, Weight own, Weight quadrant[4]) {
        untied_quadrants(i, own, quadrant);
      });
    }
  }

  // Most rows hold no new maximum: their largest values are found without branches.
  template <class Quadrants>
  void keep_best(std::int64_t begin, std::int64_t size, KsBest best[2],
                 Quadrants quadrants_of) const {
    const std::uint8_t* const second = sweep_.second_by_y + begin;
    Weight largest[2] = {0, 0};
    for (std::int64_t i = 0; i < size; ++i) {
      const Weight is_second = Weight(0) - Weight(second[i]); // all ones or 0
      Weight quadrant[4];
      quadrants_of(i, (weight_[0] & ~is_second) | (weight_[1] & is_second), quadrant);
      const Weight value = ks_largest(quadrant);
      largest[0] = ks_larger(largest[0], Weight(value & ~is_second));
      largest[1] = ks_larger(largest[1], Weight(value & is_second));
    }
    for (int sample = 0; sample < 2; ++sample) {
      if (largest[sample] == 0 || largest[sample] < best[sample].value) {
        continue;
      }
      for (std::int64_t i = 0; i < size; ++i) {
        if (second[i] == sample) {
          Weight quadrant[4];
          quadrants_of(i, weight_[sample], quadrant);
          ks_keep_best(quadrant, sweep_.x_position[begin + i], best[sample]);
        }
      }
    }
  }

  KsSweep sweep_;
  Weight weight_[2];
  std::int64_t columns_;
  Place* place_;       // by column, in it by y
  Counted* counted_;   // in the same order
  std::int32_t* next_; // by column: where its next point goes
  std::int32_t run_bits_ = 0;
  std::int64_t slots_;
  Weight* column_; // by slot: weight of the column's points in earlier rows
  Weight* corner_; // by slot: weight of the points of earlier columns and rows
  KsBlock<Place> by_place_;
  KsBlock<Column> by_column_;
  Column* column_of_;  // of the points of a row
  std::int32_t* slot_; // of their columns
  Weight* left_;
  Weight* strip_;
  Origins origins_;
};

DRIFTWALK_LANES_END
