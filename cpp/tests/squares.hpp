// Squares as four corners, measured without the formulas of the kernel.
#pragma once

#include "synthetic_tank.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace squares {

inline const double pi = std::acos(-1.0);

struct Square {
  double x, y, theta, side;

  double corner_x(int k) const {
    return x + side * std::sqrt(0.5) * std::cos(theta + (k + 0.5) * pi / 2);
  }
  double corner_y(int k) const {
    return y + side * std::sqrt(0.5) * std::sin(theta + (k + 0.5) * pi / 2);
  }
};

// How deep two squares are in each other: the shortest way out over all directions of their sides,
// from the corners' extents. Negative when they are apart.
inline double overlap(const Square& a, const Square& b) {
  double least = std::numeric_limits<double>::infinity();
  for (const double angle : {a.theta, a.theta + pi / 2, b.theta, b.theta + pi / 2}) {
    double low_a = 1e9, high_a = -1e9, low_b = 1e9, high_b = -1e9;
    for (int k = 0; k < 4; ++k) {
      const double at_a = a.corner_x(k) * std::cos(angle) + a.corner_y(k) * std::sin(angle);
      const double at_b = b.corner_x(k) * std::cos(angle) + b.corner_y(k) * std::sin(angle);
      low_a = std::min(low_a, at_a);
      high_a = std::max(high_a, at_a);
      low_b = std::min(low_b, at_b);
      high_b = std::max(high_b, at_b);
    }
    least = std::min(least, std::min(high_a, high_b) - std::max(low_a, low_b));
  }
  return least;
}

// How far the farthest corner is outside the tank [m].
inline double outside(const synthetic::Tank& tank, const Square& square) {
  double depth = -1;
  for (int k = 0; k < 4; ++k) {
    const double x = square.corner_x(k), y = square.corner_y(k);
    if (tank.edges.empty()) {
      depth = std::max(depth, std::hypot(x, y) - tank.model.radius);
    }
    for (std::size_t e = 0; e < tank.edges.size(); e += 3) {
      depth = std::max(depth, tank.edges[e] * x + tank.edges[e + 1] * y - tank.edges[e + 2]);
    }
  }
  return depth;
}

} // namespace squares
