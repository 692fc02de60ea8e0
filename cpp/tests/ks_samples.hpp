// Random samples for the tests of the KS statistic, and the statistic by a tree of sums.
#pragma once

#include "driftwalk/stats/ks2d.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <vector>

namespace {

using namespace driftwalk;
using Values = std::vector<double>;

struct Sample {
  Values x;
  Values y;
  std::int64_t size() const { return std::int64_t(x.size()); }
};

// Normal numbers; with `levels` > 0 rounded, so that many are equal.
[[maybe_unused]] Sample random_sample(std::mt19937_64& generator, std::int64_t n, int levels) {
  std::normal_distribution<double> normal;
  Sample sample;
  for (std::int64_t i = 0; i < n; ++i) {
    const double x = normal(generator);
    const double y = normal(generator);
    sample.x.push_back(levels > 0 ? std::round(x * levels) / levels : x);
    sample.y.push_back(levels > 0 ? std::round(y * levels) / levels : y);
  }
  return sample;
}

// Prefix sums that change.
class SumTree {
public:
  explicit SumTree(std::size_t size) : sums_(size + 1) {}
  void add(std::size_t at, std::int64_t weight) {
    for (++at; at < sums_.size(); at += at & (~at + 1)) {
      sums_[at] += weight;
    }
  }
  std::int64_t before(std::size_t end) const {
    std::int64_t sum = 0;
    for (; end > 0; end &= end - 1) {
      sum += sums_[end];
    }
    return sum;
  }

private:
  std::vector<std::int64_t> sums_;
};

struct Differences {
  std::int64_t d1 = 0;
  std::int64_t d2 = 0;
};

// D1 and D2 times n1 n2 from a sweep along x over a tree of the values of y: O(n log n), and
// nothing in common with what it tests.
[[maybe_unused]] Differences by_tree(const Sample& a, const Sample& b, KsTies ties) {
  struct Point {
    double x;
    std::size_t rank; // of y among the different values
    std::int64_t weight;
    std::int64_t inside[2][2]; // weight of {x < X or <= X, y < Y or <= Y}
    std::int64_t left[2];
  };
  Values ys = a.y;
  ys.insert(ys.end(), b.y.begin(), b.y.end());
  std::sort(ys.begin(), ys.end());
  ys.erase(std::unique(ys.begin(), ys.end()), ys.end());
  std::vector<Point> points;
  std::vector<std::int64_t> at_y(ys.size());
  const auto take = [&](const Sample& sample, std::int64_t weight) {
    for (std::size_t i = 0; i < sample.x.size(); ++i) {
      const auto rank = std::lower_bound(ys.begin(), ys.end(), sample.y[i]) - ys.begin();
      points.push_back({sample.x[i], std::size_t(rank), weight, {}, {}});
      at_y[std::size_t(rank)] += weight;
    }
  };
  take(a, b.size());
  take(b, -a.size());
  std::vector<std::int64_t> below(ys.size() + 1); // weight of the ranks before
  for (std::size_t rank = 0; rank < ys.size(); ++rank) {
    below[rank + 1] = below[rank] + at_y[rank];
  }
  std::sort(points.begin(), points.end(), [](const Point& p, const Point& q) { return p.x < q.x; });
  SumTree tree(ys.size());
  for (std::size_t begin = 0, end = 0; begin < points.size(); begin = end) {
    for (; end < points.size() && points[end].x == points[begin].x; ++end) {
    }
    for (int closed = 0; closed < 2; ++closed) {
      for (std::size_t i = begin; i < end; ++i) {
        Point& p = points[i];
        p.inside[closed][0] = tree.before(p.rank);
        p.inside[closed][1] = tree.before(p.rank + 1);
        p.left[closed] = tree.before(ys.size());
      }
      for (std::size_t i = begin; closed == 0 && i < end; ++i) {
        tree.add(points[i].rank, points[i].weight);
      }
    }
  }
  Differences found;
  for (const Point& p : points) {
    std::int64_t& largest = p.weight > 0 ? found.d1 : found.d2;
    const std::int64_t under[2] = {below[p.rank], below[p.rank + 1]};
    for (int closed = 0; closed < (ties == KsTies::limits ? 4 : 1); ++closed) {
      const int in_x = closed & 1;
      const int in_y = closed >> 1;
      for (const std::int64_t quadrant :
           {p.inside[in_x][in_y], under[in_y] - p.inside[1 - in_x][in_y],
            p.left[in_x] - p.inside[in_x][1 - in_y],
            p.inside[1 - in_x][1 - in_y] - p.left[1 - in_x] - under[1 - in_y]}) {
        largest = std::max<std::int64_t>(largest, std::abs(quadrant));
      }
    }
  }
  return found;
}

} // namespace
