// The spline flow and its gradient at the eight strips of a side.
#pragma once

#include "driftwalk/infer/eight.hpp"
#include "driftwalk/infer/problem.hpp"

DRIFTWALK_LANES_BEGIN

// Places in one direction of the grid.
struct SplinePlaces {
  EightIndices cell;
  Eight along; // in the cell, [0, 1]
  Eight slope; // d(along)/d(position): 1 / spacing, 0 beyond the grid [1/m]
};

inline SplinePlaces spline_places(Eight position, double origin, double spacing, int nodes) {
  const Eight raw = (position - origin) / spacing;
  const Eight place = at_most(at_least(raw, eight(0)), eight(nodes - 3));
  EightIndices cell = __builtin_convertvector(place, EightIndices);
  cell = cell > nodes - 4 ? EightIndices{} + (nodes - 4) : cell; // the far end of the last cell
  return {cell, place - __builtin_convertvector(cell, Eight),
          place == raw ? eight(1 / spacing) : eight(0)};
}

// The four B-splines that count on a cell, and their derivatives by the place in it.
struct SplineWeights {
  Eight value[4], slope[4];
};

inline SplineWeights spline_weights(Eight t) {
  const Eight t2 = t * t, t3 = t2 * t;
  constexpr double sixth = 1.0 / 6;
  return {{(1 - 3 * t + 3 * t2 - t3) * sixth, (4 - 6 * t2 + 3 * t3) * sixth,
           (1 + 3 * t + 3 * t2 - 3 * t3) * sixth, t3 * sixth},
          {(-1 + 2 * t - t2) * 0.5, (-4 * t + 3 * t2) * 0.5, (1 + 2 * t - 3 * t2) * 0.5, t2 * 0.5}};
}

// The same at one place, each weight twice: for u and for v of a node.
struct PairedWeights {
  Eight value, slope;
};

inline PairedWeights paired_weights(double t) {
  constexpr double s = 1.0 / 6;
  const Eight constant{s, s, 4 * s, 4 * s, s, s, 0, 0};
  const Eight linear{-.5, -.5, 0, 0, .5, .5, 0, 0};
  const Eight square{.5, .5, -1, -1, .5, .5, 0, 0};
  const Eight cube{-s, -s, .5, .5, -.5, -.5, s, s};
  return {constant + t * (linear + t * (square + t * cube)),
          linear + t * (2 * square + t * (3 * cube))};
}

inline Four four_weights(double t) {
  constexpr double s = 1.0 / 6;
  const Four constant{s, 4 * s, s, 0}, linear{-.5, 0, .5, 0}, square{.5, -1, .5, 0},
      cube{-s, .5, -.5, s};
  return constant + t * (linear + t * (square + t * cube));
}

struct FlowAtStrips {
  Eight u, v;               // [m/s]
  Eight u_x, u_y, v_x, v_y; // [1/s]
};

// Where the strips are on the grid: what the flow and its derivative by the coefficients share.
struct StripsOnGrid {
  double weight_y[4][8];
  double along_x[8];
  Int32 node[8];
};

// Adds up the four nodes of a row, u and v apart.
inline void store_pair(double* to, Eight products) {
  const Four four = fold(products);
  to[0] = four[0] + four[2];
  to[1] = four[1] + four[3];
}

inline void split_pairs(const double* pairs, Eight& first, Eight& second) {
  for (int lane = 0; lane < 8; ++lane) {
    first[lane] = pairs[2 * lane];
    second[lane] = pairs[2 * lane + 1];
  }
}

inline FlowAtStrips flow_at_strips(const SplineView& flow, Eight x, Eight y, StripsOnGrid& grid) {
  const SplinePlaces in_x = spline_places(x, flow.origin_x, flow.spacing, flow.columns);
  const SplinePlaces in_y = spline_places(y, flow.origin_y, flow.spacing, flow.rows);
  const SplineWeights by_y = spline_weights(in_y.along);
  const EightIndices node = in_y.cell * flow.columns + in_x.cell;
  double slope_y[4][8];
  for (int row = 0; row < 4; ++row) {
    store(grid.weight_y[row], by_y.value[row]);
    store(slope_y[row], by_y.slope[row]);
  }
  store(grid.along_x, in_x.along);
  __builtin_memcpy(grid.node, &node, sizeof node);
  double value[16], slope_by_x[16], slope_by_y[16];
  for (int lane = 0; lane < 8; ++lane) {
    const double* const corner = flow.nodes + 2 * std::int64_t(grid.node[lane]);
    Eight rows{}, rows_y{};
    for (int row = 0; row < 4; ++row) {
      const Eight nodes = load_eight(corner + 2 * row * std::int64_t(flow.columns));
      rows += nodes * grid.weight_y[row][lane];
      rows_y += nodes * slope_y[row][lane];
    }
    const PairedWeights by_x = paired_weights(grid.along_x[lane]);
    store_pair(value + 2 * lane, rows * by_x.value);
    store_pair(slope_by_x + 2 * lane, rows * by_x.slope);
    store_pair(slope_by_y + 2 * lane, rows_y * by_x.value);
  }
  FlowAtStrips at;
  split_pairs(value, at.u, at.v);
  split_pairs(slope_by_x, at.u_x, at.v_x);
  split_pairs(slope_by_y, at.u_y, at.v_y);
  at.u_x *= in_x.slope;
  at.v_x *= in_x.slope;
  at.u_y *= in_y.slope;
  at.v_y *= in_y.slope;
  return at;
}

DRIFTWALK_LANES_END
