// A flow that changes its shape: layers of spline nodes, each times its own strength in time,
//     u(x, y, t) = sum over k of s_k(t) u_k(x, y)
// The layers are summed over the nodes near the block alone; the sum is the flow of one layer.
#pragma once

#include "driftwalk/infer/problem.hpp"

DRIFTWALK_LANES_BEGIN

// The strength of each layer, and its derivative by time [1/s], at a `share` of the interval from
// the sample k - 1 to k.
inline void layer_strengths(const Track& track, int layers, std::int64_t k, double share,
                            double* strength, double* rate) {
  for (int layer = 0; layer < layers; ++layer) {
    const double* const of_layer = track.strength + layer * track.samples;
    const double before = of_layer[k - 1], after = of_layer[k];
    strength[layer] = before + (after - before) * share;
    rate[layer] = (after - before) / (track.time[k] - track.time[k - 1]);
  }
}

// Nodes from the first to before the last, along both axes.
struct NodesNear {
  int first_column, last_column, first_row, last_row;
};

inline int cell_at(double position, double origin, double spacing, int nodes) {
  const double raw = (position - origin) / spacing;
  const double place = raw > 0 ? (raw < nodes - 4 ? raw : nodes - 4) : 0;
  return static_cast<int>(place);
}

// The nodes that count within a reach of a place. One more cell on either side: on the edge of two
// cells rounding decides which of them is read.
inline NodesNear nodes_near(const SplineView& flow, double x, double y, double reach) {
  const auto low = [](int cell) { return cell > 0 ? cell - 1 : 0; };
  const auto high = [](int cell, int nodes) { return cell + 5 < nodes ? cell + 5 : nodes; };
  return {low(cell_at(x - reach, flow.origin_x, flow.spacing, flow.columns)),
          high(cell_at(x + reach, flow.origin_x, flow.spacing, flow.columns), flow.columns),
          low(cell_at(y - reach, flow.origin_y, flow.spacing, flow.rows)),
          high(cell_at(y + reach, flow.origin_y, flow.spacing, flow.rows), flow.rows)};
}

// Writes the sum of the layers, each times its weight, over the nodes near the block.
inline void sum_layers(const SplineView& flow, const NodesNear& near, const double* weight,
                       double* sum) {
  const std::int64_t size = 2 * std::int64_t(flow.rows) * flow.columns;
  const int count = 2 * (near.last_column - near.first_column);
  for (int row = near.first_row; row < near.last_row; ++row) {
    const std::int64_t first = 2 * (std::int64_t(row) * flow.columns + near.first_column);
    double* const to = sum + first;
    for (int k = 0; k < count; ++k) {
      to[k] = 0;
    }
    for (int layer = 0; layer < flow.layers; ++layer) {
      const double* const from = flow.nodes + layer * size + first;
      for (int k = 0; weight[layer] != 0 && k < count; ++k) {
        to[k] += weight[layer] * from[k];
      }
    }
  }
}

DRIFTWALK_LANES_END
