// Peacock's statistic in O(n log n): a sweep along x with a segment tree over the values of y that
// knows the sum and the largest and smallest prefix sum of the weights met so far.
#include "driftwalk/stats/ks2d_order.hpp"

#include <algorithm>
#include <cstdlib>
#include <limits>

namespace driftwalk {
namespace {

template <class Weight>
struct Node {
  Weight sum = 0;
  Weight highest = 0; // prefix sum, the empty prefix among them
  Weight lowest = 0;
};

template <class Weight>
class PrefixTree {
public:
  explicit PrefixTree(std::int64_t leaves) {
    while (leaves_ < leaves) {
      leaves_ *= 2;
    }
    nodes_.resize(static_cast<std::size_t>(2 * leaves_));
  }

  void add(std::int64_t leaf, Weight weight) {
    std::int64_t i = leaf + leaves_;
    Node<Weight> node = nodes_[i];
    node.sum += weight;
    node.highest = std::max<Weight>(node.sum, 0);
    node.lowest = std::min<Weight>(node.sum, 0);
    nodes_[i] = node;
    for (i /= 2; i > 0; i /= 2) {
      const Node<Weight> left = nodes_[2 * i];
      const Node<Weight> right = nodes_[2 * i + 1];
      nodes_[i] = {left.sum + right.sum, std::max(left.highest, left.sum + right.highest),
                   std::min(left.lowest, left.sum + right.lowest)};
    }
  }

  const Node<Weight>& all() const { return nodes_[1]; }

private:
  std::int64_t leaves_ = 1;
  std::vector<Node<Weight>> nodes_;
};

// Rank of every point's y among the distinct values, by position in x.
std::vector<std::int32_t> y_ranks(const KsGeometry& g, std::int64_t& distinct) {
  std::vector<std::int32_t> ranks(static_cast<std::size_t>(g.n));
  std::int32_t rank = -1;
  for (std::int64_t k = 0; k < g.n; ++k) {
    rank += g.starts_in_y(k);
    ranks[g.x_position[k]] = rank;
  }
  distinct = rank + 1;
  return ranks;
}

// Where along y the cut behind `position` reaches the value that the sweep found.
void find_y(const KsGeometry& g, const std::int64_t weight[2], KsCut& cut) {
  const bool right = (cut.quadrant & 1) != 0;
  const auto weight_at = [&](std::int64_t k) {
    return (g.x_position[k] > cut.position) == right ? weight[g.second_by_y[k]] : 0;
  };
  std::int64_t rest = 0;
  for (std::int64_t k = 0; k < g.n; ++k) {
    rest += weight_at(k);
  }
  const bool above = (cut.quadrant & 2) != 0;
  std::int64_t below = 0;
  for (std::int64_t k = 0; k < g.n; ++k) {
    below += weight_at(k);
    const bool ends = k + 1 == g.n || g.starts_in_y(k + 1);
    if (ends && std::abs(above ? rest - below : below) == cut.value) {
      cut.y_position = k;
      return;
    }
  }
}

// Check the half plane that the tree now holds: x <= X when it grows to the right.
template <class Weight>
void check(const Node<Weight>& half, std::int64_t position, bool right, KsCut& cut) {
  const std::int64_t below = std::max(half.highest, -half.lowest);
  const std::int64_t above = std::max(half.sum - half.lowest, half.highest - half.sum);
  const std::int64_t value = std::max(below, above);
  if (value > cut.value) {
    cut = {value, position, -1, (right ? 1 : 0) + (above > below ? 2 : 0)};
  }
}

template <class Weight>
KsCut sweep_both_ways(const KsGeometry& g, const std::int64_t weight[2]) {
  std::int64_t distinct = 0;
  const std::vector<std::int32_t> rank = y_ranks(g, distinct);
  const Weight weights[2] = {Weight(weight[0]), Weight(weight[1])};
  KsCut cut;
  PrefixTree<Weight> left(distinct);
  for (std::int64_t k = 0; k < g.n; ++k) {
    left.add(rank[k], weights[g.second_by_x[k]]);
    if (k + 1 == g.n || g.starts_in_x(k + 1)) {
      check(left.all(), k, false, cut);
    }
  }
  PrefixTree<Weight> right(distinct);
  for (std::int64_t k = g.n - 1; k > 0; --k) {
    right.add(rank[k], weights[g.second_by_x[k]]);
    if (g.starts_in_x(k)) {
      check(right.all(), k - 1, true, cut);
    }
  }
  return cut;
}

} // namespace

KsCut ks_largest_cut(const KsGeometry& g, const std::int64_t weight[2], std::int64_t total) {
  KsCut cut = total <= std::numeric_limits<std::int32_t>::max() / 2
                  ? sweep_both_ways<std::int32_t>(g, weight)
                  : sweep_both_ways<std::int64_t>(g, weight);
  if (cut.position >= 0) {
    find_y(g, weight, cut);
  }
  return cut;
}

} // namespace driftwalk
