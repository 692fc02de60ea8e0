// The spline flow and its gradient at the eight strips of a side.
#pragma once

#include "driftwalk/infer/problem.hpp"
#include "driftwalk/math/doubles.hpp"

DRIFTWALK_LANES_BEGIN

// Places in one direction of the grid.
struct SplinePlaces {
  Eight cell;  // a whole number
  Eight along; // place in the cell, [0, 1]
  Eight slope; // d(along)/d(position): 1 / spacing, 0 beyond the grid [1/m]
};

inline SplinePlaces spline_places(Eight position, double origin, double spacing, int nodes) {
  const Eight raw = (position - origin) / spacing;
  const Eight place = at_most(at_least(raw, 0), nodes - 3);
  // Adding 1.5 * 2^52 rounds to a whole number: on the edge of two cells either will do.
  constexpr double to_whole = 6755399441055744.0;
  const Eight cell = at_most(at_least((place - 0.5 + to_whole) - to_whole, 0), nodes - 4);
  return {cell, place - cell, select(place == raw, Eight(1 / spacing), Eight(0))};
}

inline constexpr double sixth = 1.0 / 6;

// The four B-splines that count on a cell, and their derivatives by the place in it.
struct SplineWeights {
  Eight value[4], slope[4];
};

inline SplineWeights spline_weights(Eight t) {
  const Eight t2 = t * t, t3 = t2 * t;
  return {{(1 - 3 * t + 3 * t2 - t3) * sixth, (4 - 6 * t2 + 3 * t3) * sixth,
           (1 + 3 * t + 3 * t2 - 3 * t3) * sixth, t3 * sixth},
          {(-1 + 2 * t - t2) * 0.5, (-4 * t + 3 * t2) * 0.5, (1 + 2 * t - 3 * t2) * 0.5, t2 * 0.5}};
}

// The same weights, by powers of the place in the cell: at one place for the four nodes of a row,
// or for (u, v) of each of them.
template <int N>
struct CubicWeights {
  double constant[N], linear[N], square[N], cube[N];

  Doubles<N> value(double t) const {
    using Real = Doubles<N>;
    return Real::load(constant) +
           t * (Real::load(linear) + t * (Real::load(square) + t * Real::load(cube)));
  }
  Doubles<N> slope(double t) const {
    using Real = Doubles<N>;
    return Real::load(linear) + t * (2 * Real::load(square) + t * (3 * Real::load(cube)));
  }
};

alignas(64) inline constexpr CubicWeights<4> row_weights{
    {sixth, 4 * sixth, sixth, 0}, {-.5, 0, .5, 0}, {.5, -1, .5, 0}, {-sixth, .5, -.5, sixth}};
alignas(64) inline constexpr CubicWeights<8> paired_weights{
    {sixth, sixth, 4 * sixth, 4 * sixth, sixth, sixth, 0, 0},
    {-.5, -.5, 0, 0, .5, .5, 0, 0},
    {.5, .5, -1, -1, .5, .5, 0, 0},
    {-sixth, -sixth, .5, .5, -.5, -.5, sixth, sixth}};

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
inline void store_sums(double* u, double* v, Eight products) {
  const Four four = fold(products);
  *u = four[0] + four[2];
  *v = four[1] + four[3];
}

inline FlowAtStrips flow_at_strips(const SplineView& flow, Eight x, Eight y, StripsOnGrid& grid) {
  const SplinePlaces in_x = spline_places(x, flow.origin_x, flow.spacing, flow.columns);
  const SplinePlaces in_y = spline_places(y, flow.origin_y, flow.spacing, flow.rows);
  const SplineWeights by_y = spline_weights(in_y.along);
  const Eight node = in_y.cell * flow.columns + in_x.cell;
  double slope_y[4][8];
  for (int row = 0; row < 4; ++row) {
    by_y.value[row].store(grid.weight_y[row]);
    by_y.slope[row].store(slope_y[row]);
  }
  in_x.along.store(grid.along_x);
  double u[8], v[8], u_x[8], v_x[8], u_y[8], v_y[8];
  for (int lane = 0; lane < 8; ++lane) {
    grid.node[lane] = static_cast<Int32>(node[lane]);
    const double* const corner = flow.nodes + 2 * std::int64_t(grid.node[lane]);
    Eight rows = 0, rows_y = 0;
    for (int row = 0; row < 4; ++row) {
      const Eight nodes = Eight::load(corner + 2 * row * std::int64_t(flow.columns));
      rows += nodes * grid.weight_y[row][lane];
      rows_y += nodes * slope_y[row][lane];
    }
    const Eight by_x = paired_weights.value(grid.along_x[lane]);
    store_sums(u + lane, v + lane, rows * by_x);
    store_sums(u_x + lane, v_x + lane, rows * paired_weights.slope(grid.along_x[lane]));
    store_sums(u_y + lane, v_y + lane, rows_y * by_x);
  }
  return {Eight::load(u),
          Eight::load(v),
          Eight::load(u_x) * in_x.slope,
          Eight::load(u_y) * in_y.slope,
          Eight::load(v_x) * in_x.slope,
          Eight::load(v_y) * in_y.slope};
}

DRIFTWALK_LANES_END
