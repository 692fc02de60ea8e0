// Positions of the pooled points from two sorted samples, and the weights of ties.
#include "driftwalk/stats/ks2d_order.hpp"

namespace driftwalk {
namespace {

// Merge two sorted axes into the pooled order and call visit(position, pooled index, key).
template <class Visit>
void merge(const KsSortedAxis& first, std::int64_t n1, const KsSortedAxis& second, std::int64_t n2,
           Visit visit) {
  const std::uint64_t* const a = first.key.data();
  const std::uint64_t* const b = second.key.data();
  std::int64_t i = 0;
  std::int64_t j = 0;
  while (i < n1 && j < n2) {
    // Which side comes next is a coin toss: selected by masks, as a branch would be guessed wrong
    // half of the time.
    const std::uint64_t key_a = a[i];
    const std::uint64_t key_b = b[j];
    const std::int32_t point_a = first.index[i];
    const std::int32_t point_b = second.index[j] + std::int32_t(n1);
    const std::int64_t take_b = key_b < key_a;
    const std::uint64_t mask = std::uint64_t(-take_b);
    const std::int32_t point = point_a ^ ((point_a ^ point_b) & std::int32_t(mask));
    visit(i + j, point, key_a ^ ((key_a ^ key_b) & mask));
    i += 1 - take_b;
    j += take_b;
  }
  for (; i < n1; ++i) {
    visit(i + j, first.index[i], a[i]);
  }
  for (; j < n2; ++j) {
    visit(i + j, second.index[j] + std::int32_t(n1), b[j]);
  }
}

// Start of the run of equal values that each position belongs to, by point; `next` gets the same
// starts by position, as counters to fill the runs anew.
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
void order_ties(KsGeometry& g) {
  ks_grow(g.start_of, g.n);
  ks_grow(g.next, g.n);
  run_starts(g.x_starts, g.point.data(), g.n, g.start_of, g.next);
  for (std::int64_t k = g.n - 1; k >= 0; --k) {
    const std::int32_t point = g.y_point[k];
    g.point[g.next[g.start_of[point]]++] = point;
  }
  run_starts(g.y_starts, g.y_point.data(), g.n, g.start_of, g.next);
  for (std::int64_t k = g.n - 1; k >= 0; --k) {
    const std::int32_t point = g.point[k];
    g.y_position[k] = g.next[g.start_of[point]]++;
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
  ks_grow(g.y_point, g.n);
  ks_grow(g.position_of, g.n);
  std::int64_t x_runs = 0;
  std::int64_t y_runs = 0;
  std::uint64_t previous = 0; // the key of a NaN: no finite number has it
  merge(first.y, first.n, second.y, second.n,
        [&](std::int64_t k, std::int32_t point, std::uint64_t key) {
          g.y_point[k] = point;
          g.position_of[point] = std::int32_t(k);
          g.y_starts[k] = key != previous;
          y_runs += key != previous;
          previous = key;
        });
  previous = 0;
  merge(first.x, first.n, second.x, second.n,
        [&](std::int64_t k, std::int32_t point, std::uint64_t key) {
          g.point[k] = point;
          g.y_position[k] = g.position_of[point];
          g.x_starts[k] = key != previous;
          x_runs += key != previous;
          previous = key;
        });
  g.tied = 0;
  if (x_runs != g.n || y_runs != g.n) {
    order_ties(g);
    g.tied = count_tied(g);
  }
  for (std::int64_t k = 0; k < g.n; ++k) {
    g.second[k] = g.point[k] >= first.n;
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

void ks_tied_weights(const KsGeometry& g, const std::uint8_t* second,
                     const std::int64_t weight[2], KsTiedWeights& weights) {
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
