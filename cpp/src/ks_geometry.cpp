// Positions of the pooled points from two sorted samples, and the weights of ties.
#include "driftwalk/stats/ks2d_order.hpp"

namespace driftwalk {
namespace {

// One comparison of the merge. Which side comes next is a coin toss: it is selected by masks, as a
// branch would be guessed wrong half of the time.
struct Merged {
  std::uint64_t key;
  std::int32_t point;
};
Merged select(bool take_b, std::uint64_t key_a, std::int32_t point_a, std::uint64_t key_b,
              std::int32_t point_b) {
  const std::uint64_t mask = std::uint64_t(0) - std::uint64_t(take_b);
  return {key_a ^ ((key_a ^ key_b) & mask), point_a ^ ((point_a ^ point_b) & std::int32_t(mask))};
}

// Merge two sorted axes into the pooled order: call place(position, pooled index), set `starts` to
// 1 where a new value begins and return how many values there are.
//
// The merge runs from both ends at once, as either end waits for the outcome of its last
// comparison.
template <class Place>
std::int64_t merge(const KsSortedAxis& first, std::int64_t n1, const KsSortedAxis& second,
                   std::int64_t n2, std::uint8_t* starts, Place place) {
  const std::uint64_t* const a = first.key.data();
  const std::uint64_t* const b = second.key.data();
  const std::int32_t* const point_a = first.index.data();
  const std::int32_t* const point_b = second.index.data();
  const std::int32_t offset = std::int32_t(n1);
  std::int64_t i = 0;
  std::int64_t j = 0;
  std::int64_t i_end = n1;
  std::int64_t j_end = n2;
  std::uint64_t below = 0;                 // the last key from below, and the last from
  std::uint64_t above = ~std::uint64_t(0); // above; at first what no finite number has
  std::int64_t runs = 0;
  while (i_end - i > 1 && j_end - j > 1) {
    const bool take_b = b[j] < a[i];
    const Merged low = select(take_b, a[i], point_a[i], b[j], point_b[j] + offset);
    place(i + j, low.point);
    starts[i + j] = low.key != below;
    runs += low.key != below;
    below = low.key;
    i += !take_b;
    j += take_b;

    const bool take_b_end = b[j_end - 1] >= a[i_end - 1];
    const Merged high = select(take_b_end, a[i_end - 1], point_a[i_end - 1], b[j_end - 1],
                               point_b[j_end - 1] + offset);
    const std::int64_t last = i_end + j_end - 1;
    place(last, high.point);
    if (last + 1 < n1 + n2) {
      starts[last + 1] = high.key != above;
    }
    runs += high.key != above;
    above = high.key;
    i_end -= !take_b_end;
    j_end -= take_b_end;
  }
  while (i < i_end || j < j_end) {
    const bool take_b = i == i_end || (j < j_end && b[j] < a[i]);
    const std::uint64_t key = take_b ? b[j] : a[i];
    place(i + j, take_b ? point_b[j] + offset : point_a[i]);
    starts[i + j] = key != below;
    runs += key != below;
    below = key;
    i += !take_b;
    j += take_b;
  }
  // Where the two ends meet.
  if (i + j < n1 + n2) {
    starts[i + j] = above != below;
    runs -= above == below;
  }
  return runs;
}

// Start of the run of equal values that each position belongs to, by point; `next` gets the same
// starts by position, as counters to refill the runs.
void run_starts(const std::vector<std::uint8_t>& starts, const std::int32_t* point, std::int64_t n,
                std::vector<std::int32_t>& start_of, std::vector<std::int32_t>& next) {
  std::int32_t start = 0;
  for (std::int64_t k = 0; k < n; ++k) {
    if (starts[k] != 0) {
      start = std::int32_t(k);
      next[k] = start;
    }
    start_of[point[k]] = start;
  }
}

std::int64_t count_tied(const KsGeometry& g) {
  const auto alone = [n = g.n](const std::vector<std::uint8_t>& starts, std::int64_t k) {
    return starts[k] != 0 && (k + 1 == n || starts[k + 1] != 0);
  };
  std::int64_t tied = 0;
  for (std::int64_t k = 0; k < g.n; ++k) {
    tied += !alone(g.x_starts, k) || !alone(g.y_starts, g.y_position[k]);
  }
  return tied;
}

// Equal x by descending y, then equal y by descending position in x.
void order_ties(KsGeometry& g, std::int64_t n1) {
  ks_grow(g.y_point, g.n);
  ks_grow(g.start_of, g.n);
  ks_grow(g.next, g.n);
  for (std::int64_t point = 0; point < g.n; ++point) {
    g.y_point[g.position_of[point]] = std::int32_t(point);
  }
  run_starts(g.x_starts, g.point.data(), g.n, g.start_of, g.next);
  for (std::int64_t k = g.n - 1; k >= 0; --k) {
    const std::int32_t point = g.y_point[k];
    g.point[g.next[g.start_of[point]]++] = point;
  }
  run_starts(g.y_starts, g.y_point.data(), g.n, g.start_of, g.next);
  for (std::int64_t k = g.n - 1; k >= 0; --k) {
    const std::int32_t point = g.point[k];
    g.y_position[k] = g.next[g.start_of[point]]++;
    g.second[k] = point >= n1;
  }
}

} // namespace

void ks_geometry(const KsSortedSample& first, const KsSortedSample& second, KsGeometry& g) {
  g.n = first.n + second.n;
  ks_grow(g.point, g.n);
  ks_grow(g.y_position, g.n);
  ks_grow(g.second, g.n);
  ks_grow(g.x_starts, g.n);
  ks_grow(g.y_starts, g.n);
  ks_grow(g.position_of, g.n);
  const std::int64_t y_runs =
      merge(first.y, first.n, second.y, second.n, g.y_starts.data(),
            [position_of = g.position_of.data()](std::int64_t k, std::int32_t point) {
              position_of[point] = std::int32_t(k);
            });
  const std::int64_t x_runs = merge(first.x, first.n, second.x, second.n, g.x_starts.data(),
                                    [position_of = g.position_of.data(), points = g.point.data(),
                                     y_position = g.y_position.data(), labels = g.second.data(),
                                     n1 = first.n](std::int64_t k, std::int32_t point) {
                                      points[k] = point;
                                      y_position[k] = position_of[point];
                                      labels[k] = point >= n1;
                                    });
  g.tied = 0;
  if (x_runs != g.n || y_runs != g.n) {
    order_ties(g, first.n);
    g.tied = count_tied(g);
  }
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
std::int64_t column_weights(const KsGeometry& g, const std::uint8_t* second,
                            const std::int64_t weight[2], std::int64_t begin, std::int64_t end,
                            KsTied* tied) {
  std::int64_t column = 0;
  for (std::int64_t top = end; top > begin;) {
    std::int64_t bottom = top - 1;
    std::int64_t y = g.y_position[bottom];
    std::int64_t equal = weight[second[bottom]];
    while (bottom > begin && g.y_position[bottom - 1] == y + 1 && g.y_starts[y + 1] == 0) {
      --bottom;
      ++y;
      equal += weight[second[bottom]];
    }
    for (std::int64_t k = bottom; k < top; ++k) {
      tied[k].column = column;
      tied[k].equal = equal;
    }
    column += equal;
    top = bottom;
  }
  return column;
}

// The same along a row, where x ascends from the largest position down.
std::int64_t row_weights(const KsGeometry& g, const std::int32_t* x_position, std::int64_t begin,
                         std::int64_t end, KsTied* tied) {
  std::int64_t row = 0;
  for (std::int64_t top = end; top > begin;) {
    std::int64_t bottom = top - 1;
    std::int64_t x = x_position[bottom];
    while (bottom > begin && x_position[bottom - 1] == x + 1 && g.x_starts[x + 1] == 0) {
      --bottom;
      ++x;
    }
    for (std::int64_t k = bottom; k < top; ++k) {
      tied[x_position[k]].row = row;
    }
    row += tied[x].equal;
    top = bottom;
  }
  return row;
}

} // namespace

void ks_tied_weights(const KsGeometry& g, const std::uint8_t* second, const std::int64_t weight[2],
                     KsTiedWeights& weights) {
  ks_grow(weights.tied, g.n);
  ks_grow(weights.x_position, g.n);
  KsTied* const tied = weights.tied.data();
  std::int32_t* const x_position = weights.x_position.data();
  std::int64_t left = 0;
  for (std::int64_t begin = 0; begin < g.n;) {
    const std::int64_t end = run_end(g.x_starts, begin, g.n);
    const std::int64_t column = column_weights(g, second, weight, begin, end, tied);
    for (std::int64_t k = begin; k < end; ++k) {
      tied[k].left = left;
      tied[k].left_closed = left + column;
      x_position[g.y_position[k]] = std::int32_t(k);
    }
    left += column;
    begin = end;
  }
  std::int64_t below = 0;
  for (std::int64_t begin = 0; begin < g.n;) {
    const std::int64_t end = run_end(g.y_starts, begin, g.n);
    const std::int64_t row = row_weights(g, x_position, begin, end, tied);
    for (std::int64_t k = begin; k < end; ++k) {
      tied[x_position[k]].below = below;
      tied[x_position[k]].below_closed = below + row;
    }
    below += row;
    begin = end;
  }
}

} // namespace driftwalk
