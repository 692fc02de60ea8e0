// Positions of the pooled points from two sorted samples, and the weights of ties.
#include "driftwalk/stats/ks2d_order.hpp"

#include <utility>

namespace driftwalk {
namespace {

// The first or, where `mask` is all ones, the second: compilers make a branch of a conditional
// here, and it would be guessed wrong half of the time.
std::int32_t choose(std::int32_t first, std::int32_t second, std::int32_t mask) {
  return first ^ ((first ^ second) & mask);
}

// Merge two sorted axes into the pooled order: call place(position, sample, rank) for every number
// and return how many different ones there are. `starts`, where not null, is set to 1 where a new
// one begins and to 0 elsewhere.
//
// The merge runs from both ends at once, as either end waits for the outcome of its last
// comparison. Which sample comes next is a coin toss, so nothing branches on it.
template <class Place>
std::int64_t merge(const KsSortedAxis& first, std::int64_t n1, const KsSortedAxis& second,
                   std::int64_t n2, std::uint8_t* starts, Place place) {
  const std::uint64_t* const a = first.key.data();
  const std::uint64_t* const b = second.key.data();
  std::int64_t i = 0;
  std::int64_t j = 0;
  std::int64_t i_end = n1;
  std::int64_t j_end = n2;
  std::uint64_t below = 0;                 // the last key from below, and the last from
  std::uint64_t above = ~std::uint64_t(0); // above; at first what no finite number has
  std::int64_t runs = 0;
  while (i_end - i > 1 && j_end - j > 1) {
    const std::uint64_t key_a = a[i];
    const std::uint64_t key_b = b[j];
    const bool take_b = key_b < key_a;
    const std::uint64_t low = take_b ? key_b : key_a;
    place(i + j, take_b, i, j);
    if (starts != nullptr) {
      starts[i + j] = low != below;
    }
    runs += low != below;
    below = low;
    i += !take_b;
    j += take_b;

    const std::uint64_t last_a = a[i_end - 1];
    const std::uint64_t last_b = b[j_end - 1];
    const bool take_last_b = last_b >= last_a;
    const std::uint64_t high = take_last_b ? last_b : last_a;
    const std::int64_t last = i_end + j_end - 1;
    place(last, take_last_b, i_end - 1, j_end - 1);
    if (starts != nullptr && last + 1 < n1 + n2) {
      starts[last + 1] = high != above;
    }
    runs += high != above;
    above = high;
    i_end -= !take_last_b;
    j_end -= take_last_b;
  }
  while (i < i_end || j < j_end) {
    const bool take_b = i == i_end || (j < j_end && b[j] < a[i]);
    const std::uint64_t key = take_b ? b[j] : a[i];
    place(i + j, take_b, i, j);
    if (starts != nullptr) {
      starts[i + j] = key != below;
    }
    runs += key != below;
    below = key;
    i += !take_b;
    j += take_b;
  }
  // Where the two ends meet.
  if (i + j < n1 + n2) {
    if (starts != nullptr) {
      starts[i + j] = above != below;
    }
    runs -= above == below;
  }
  return runs;
}

std::int64_t merge_x(const KsSortedSample& first, const KsSortedSample& second, KsGeometry& g,
                     std::uint8_t* starts) {
  return merge(
      first.x, first.n, second.x, second.n, starts,
      [position_of = g.position_of.data(), labels = g.second_by_x.data(),
       n1 = std::int32_t(first.n)](std::int64_t k, bool is_second, std::int64_t i, std::int64_t j) {
        const std::int32_t mask = -std::int32_t(is_second);
        position_of[choose(std::int32_t(i), n1 + std::int32_t(j), mask)] = std::int32_t(k);
        labels[k] = is_second;
      });
}

// The positions in x of one sample's points, in the order of y: looked up here and not in the
// merge, where a look-up that misses the cache would wait for the comparisons.
void by_y(const KsSortedAxis& y, std::int64_t n, const std::int32_t* position_of,
          std::int32_t* positions) {
  for (std::int64_t rank = 0; rank < n; ++rank) {
    positions[rank] = position_of[y.from[rank]];
  }
}

std::int64_t merge_y(const KsSortedSample& first, const KsSortedSample& second, KsGeometry& g,
                     std::uint8_t* starts) {
  by_y(first.y, first.n, g.position_of.data(), g.position_by_y.data());
  by_y(second.y, second.n, g.position_of.data() + first.n, g.position_by_y.data() + first.n);
  return merge(first.y, first.n, second.y, second.n, starts,
               [x_position = g.x_position.data(), labels = g.second_by_y.data(),
                of_first = g.position_by_y.data(), of_second = g.position_by_y.data() + first.n](
                   std::int64_t k, bool is_second, std::int64_t i, std::int64_t j) {
                 x_position[k] = choose(of_first[i], of_second[j], -std::int32_t(is_second));
                 labels[k] = is_second;
               });
}

// Whether all points differ in both coordinates; where new values begin, if that is wanted.
bool merge_both(const KsSortedSample& first, const KsSortedSample& second, KsGeometry& g,
                bool starts) {
  const std::int64_t x_runs = merge_x(first, second, g, starts ? g.x_starts.data() : nullptr);
  const std::int64_t y_runs = merge_y(first, second, g, starts ? g.y_starts.data() : nullptr);
  return x_runs == g.n && y_runs == g.n;
}

// Start of the run of equal values that each position belongs to; `next` gets the same starts, as
// counters to refill the runs.
void run_starts(const std::vector<std::uint8_t>& starts, std::int64_t n,
                std::vector<std::int32_t>& start_of, std::vector<std::int32_t>& next) {
  std::int32_t start = 0;
  for (std::int64_t k = 0; k < n; ++k) {
    if (starts[k] != 0) {
      start = std::int32_t(k);
      next[k] = start;
    }
    start_of[k] = start;
  }
}

std::int64_t count_tied(const KsGeometry& g) {
  const auto alone = [n = g.n](const std::vector<std::uint8_t>& starts, std::int64_t k) {
    return starts[k] != 0 && (k + 1 == n || starts[k + 1] != 0);
  };
  std::int64_t tied = 0;
  for (std::int64_t k = 0; k < g.n; ++k) {
    tied += !alone(g.y_starts, k) || !alone(g.x_starts, g.x_position[k]);
  }
  return tied;
}

// Equal x by descending y, then equal y by descending position in x. `point` is in the order of x
// before and after.
void order_ties(KsGeometry& g, std::int64_t n1) {
  ks_grow(g.start_of, g.n);
  ks_grow(g.next, g.n);
  ks_grow(g.ordered, g.n);
  std::vector<std::int32_t>& y_position = g.position_of; // the ranks have served
  run_starts(g.x_starts, g.n, g.start_of, g.next);
  for (std::int64_t k = g.n - 1; k >= 0; --k) {
    const std::int32_t before = g.x_position[k];
    const std::int32_t position = g.next[g.start_of[before]]++;
    g.ordered[position] = g.point[before];
    y_position[position] = std::int32_t(k);
  }
  std::swap(g.point, g.ordered);
  run_starts(g.y_starts, g.n, g.start_of, g.next);
  for (std::int64_t k = g.n - 1; k >= 0; --k) {
    const std::int32_t position = g.next[g.start_of[y_position[k]]]++;
    g.x_position[position] = std::int32_t(k);
    g.second_by_x[k] = g.second_by_y[position] = g.point[k] >= n1;
  }
}

} // namespace

void ks_geometry(const KsSortedSample& first, const KsSortedSample& second, KsGeometry& g) {
  g.n = first.n + second.n;
  ks_grow(g.x_position, g.n);
  ks_grow(g.second_by_x, g.n);
  ks_grow(g.second_by_y, g.n);
  ks_grow(g.position_of, g.n);
  ks_grow(g.position_by_y, g.n + 1); // the merge looks beyond the last, and drops it
  ks_grow(g.x_starts, g.n);
  ks_grow(g.y_starts, g.n);
  // Points of one sample seldom tie with those of the other alone: if they do, merge again.
  bool tied = first.x.tied || first.y.tied || second.x.tied || second.y.tied;
  if (!merge_both(first, second, g, tied) && !tied) {
    tied = true;
    merge_both(first, second, g, tied);
  }
  g.tied = 0;
  if (tied) {
    ks_points(first, second, g);
    order_ties(g, first.n);
    g.tied = count_tied(g);
  }
}

void ks_points(const KsSortedSample& first, const KsSortedSample& second, KsGeometry& g) {
  ks_grow(g.point, g.n);
  std::int64_t i = 0;
  std::int64_t j = 0;
  for (std::int64_t k = 0; k < g.n; ++k) {
    const bool is_second = g.second_by_x[k] != 0;
    g.point[k] = is_second ? std::int32_t(first.n) + second.x.from[j] : first.x.from[i];
    i += !is_second;
    j += is_second;
  }
}

std::int64_t ks_row(const KsSortedSample& first, const KsSortedSample& second, const KsGeometry& g,
                    std::int64_t position) {
  const bool is_second = g.second_by_x[position] != 0;
  if (g.tied > 0) {
    return g.point[position] - (is_second ? first.n : 0);
  }
  std::int64_t of_second = 0;
  for (std::int64_t k = 0; k < position; ++k) {
    of_second += g.second_by_x[k];
  }
  return is_second ? second.x.from[of_second] : first.x.from[position - of_second];
}

namespace {

// End of the run of equal values that begins at `begin`.
std::int64_t run_end(const std::vector<std::uint8_t>& starts, std::int64_t begin, std::int64_t n) {
  std::int64_t end = begin + 1;
  while (end < n && starts[end] == 0) {
    ++end;
  }
  return end;
}

// Within a column, from the largest position down, y ascends. Identical points are neighbours: each
// has the next position in y, in the same run of y.
std::int64_t column_weights(const KsGeometry& g, const std::int32_t* y_position,
                            const std::uint8_t* second_by_x, const std::int64_t weight[2],
                            std::int64_t begin, std::int64_t end, KsTiedInX* in_x) {
  std::int64_t column = 0;
  for (std::int64_t top = end; top > begin;) {
    std::int64_t bottom = top - 1;
    std::int64_t y = y_position[bottom];
    std::int64_t equal = weight[second_by_x[bottom]];
    while (bottom > begin && y_position[bottom - 1] == y + 1 && g.y_starts[y + 1] == 0) {
      --bottom;
      ++y;
      equal += weight[second_by_x[bottom]];
    }
    for (std::int64_t k = bottom; k < top; ++k) {
      in_x[k].column = column;
      in_x[k].equal = equal;
    }
    column += equal;
    top = bottom;
  }
  return column;
}

// The same along a row, where x ascends from the largest position down.
std::int64_t row_weights(const KsGeometry& g, const KsTiedInX* in_x, std::int64_t begin,
                         std::int64_t end, KsTiedInY* in_y) {
  std::int64_t row = 0;
  for (std::int64_t top = end; top > begin;) {
    std::int64_t bottom = top - 1;
    std::int64_t x = g.x_position[bottom];
    while (bottom > begin && g.x_position[bottom - 1] == x + 1 && g.x_starts[x + 1] == 0) {
      --bottom;
      ++x;
    }
    for (std::int64_t k = bottom; k < top; ++k) {
      in_y[k].row = row;
    }
    row += in_x[x].equal;
    top = bottom;
  }
  return row;
}

} // namespace

void ks_tied_weights(const KsGeometry& g, const std::uint8_t* second_by_x,
                     const std::int64_t weight[2], KsTiedWeights& weights) {
  ks_grow(weights.in_x, g.n);
  ks_grow(weights.in_y, g.n);
  ks_grow(weights.y_position, g.n);
  KsTiedInX* const in_x = weights.in_x.data();
  KsTiedInY* const in_y = weights.in_y.data();
  for (std::int64_t k = 0; k < g.n; ++k) {
    weights.y_position[g.x_position[k]] = std::int32_t(k);
  }
  std::int64_t left = 0;
  for (std::int64_t begin = 0; begin < g.n;) {
    const std::int64_t end = run_end(g.x_starts, begin, g.n);
    const std::int64_t column =
        column_weights(g, weights.y_position.data(), second_by_x, weight, begin, end, in_x);
    for (std::int64_t k = begin; k < end; ++k) {
      in_x[k].left = left;
      in_x[k].left_closed = left + column;
    }
    left += column;
    begin = end;
  }
  std::int64_t below = 0;
  for (std::int64_t begin = 0; begin < g.n;) {
    const std::int64_t end = run_end(g.y_starts, begin, g.n);
    const std::int64_t row = row_weights(g, in_x, begin, end, in_y);
    for (std::int64_t k = begin; k < end; ++k) {
      in_y[k].below = below;
      in_y[k].below_closed = below + row;
    }
    below += row;
    begin = end;
  }
}

} // namespace driftwalk
