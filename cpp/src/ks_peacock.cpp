// Peacock's statistic in O(n log n): a sweep along x with a segment tree over the values of y that
// knows the sum and the largest and smallest prefix sum of the weights met so far.
#include "driftwalk/stats/ks2d_order.hpp"

#include <algorithm>

namespace driftwalk {
namespace {

struct Node {
  std::int64_t sum = 0;
  std::int64_t highest = 0; // prefix sum, the empty prefix among them
  std::int64_t lowest = 0;
};

class PrefixTree {
public:
  explicit PrefixTree(std::int64_t leaves) {
    while (leaves_ < leaves) {
      leaves_ *= 2;
    }
    nodes_.resize(static_cast<std::size_t>(2 * leaves_));
  }

  void add(std::int64_t leaf, std::int64_t weight) {
    std::int64_t i = leaf + leaves_;
    nodes_[i].sum += weight;
    nodes_[i].highest = std::max<std::int64_t>(nodes_[i].sum, 0);
    nodes_[i].lowest = std::min<std::int64_t>(nodes_[i].sum, 0);
    for (i /= 2; i > 0; i /= 2) {
      const Node& left = nodes_[2 * i];
      const Node& right = nodes_[2 * i + 1];
      nodes_[i].sum = left.sum + right.sum;
      nodes_[i].highest = std::max(left.highest, left.sum + right.highest);
      nodes_[i].lowest = std::min(left.lowest, left.sum + right.lowest);
    }
  }

  const Node& all() const { return nodes_[1]; }

private:
  std::int64_t leaves_ = 1;
  std::vector<Node> nodes_;
};

// Rank of every point's y among the distinct values, by position in x.
std::vector<std::int32_t> y_ranks(const KsGeometry& g, std::int64_t& distinct) {
  std::vector<std::int32_t> rank_at(static_cast<std::size_t>(g.n));
  std::int32_t rank = -1;
  for (std::int64_t k = 0; k < g.n; ++k) {
    rank += g.y_starts[k];
    rank_at[k] = rank;
  }
  distinct = rank + 1;
  std::vector<std::int32_t> ranks(static_cast<std::size_t>(g.n));
  for (std::int64_t k = 0; k < g.n; ++k) {
    ranks[k] = rank_at[g.y_position[k]];
  }
  return ranks;
}

// Where along y the cut behind `position` reaches the value that the sweep found.
void find_y(const KsGeometry& g, const std::int64_t weight[2], KsCut& cut) {
  std::vector<std::int64_t> row(static_cast<std::size_t>(g.n));
  const bool right = (cut.quadrant & 1) != 0;
  std::int64_t rest = 0;
  for (std::int64_t k = 0; k < g.n; ++k) {
    if ((k > cut.position) == right) {
      row[g.y_position[k]] = weight[g.second[k]];
      rest += weight[g.second[k]];
    }
  }
  const bool above = (cut.quadrant & 2) != 0;
  std::int64_t below = 0;
  for (std::int64_t k = 0; k < g.n; ++k) {
    below += row[k];
    const bool ends = k + 1 == g.n || g.y_starts[k + 1] != 0;
    if (ends && std::abs(above ? rest - below : below) == cut.value) {
      cut.y_position = k;
      return;
    }
  }
}

// Check the half plane that the tree now holds: x <= X when it grows to the right.
void check(const Node& half, std::int64_t position, bool right, KsCut& cut) {
  const std::int64_t below = std::max(half.highest, -half.lowest);
  const std::int64_t above = std::max(half.sum - half.lowest, half.highest - half.sum);
  const std::int64_t value = std::max(below, above);
  if (value > cut.value) {
    cut = {value, position, -1, (right ? 1 : 0) + (above > below ? 2 : 0)};
  }
}

} // namespace

KsCut ks_largest_cut(const KsGeometry& g, const std::int64_t weight[2]) {
  std::int64_t distinct = 0;
  const std::vector<std::int32_t> rank = y_ranks(g, distinct);
  KsCut cut;
  PrefixTree left(distinct);
  for (std::int64_t k = 0; k < g.n; ++k) {
    left.add(rank[k], weight[g.second[k]]);
    if (k + 1 == g.n || g.x_starts[k + 1] != 0) {
      check(left.all(), k, false, cut);
    }
  }
  PrefixTree right(distinct);
  for (std::int64_t k = g.n - 1; k > 0; --k) {
    right.add(rank[k], weight[g.second[k]]);
    if (g.x_starts[k] != 0) {
      check(right.all(), k - 1, true, cut);
    }
  }
  if (cut.position >= 0) {
    find_y(g, weight, cut);
  }
  return cut;
}

} // namespace driftwalk
