// The push of the water's own acceleration on the block, and its derivatives.
//
// A body that displaces the mass m_w of water is pushed by m_w Du/Dt, the force that accelerates
// that water, and its added mass by the same. Averaged over a square of side a, Du/Dt is a weighted
// mean over the 3 x 3 Gauss points of the square, which turn with it, and its spin 6/a^2 times the
// mean moment about the centre. The mean is exact for polynomials of the fifth degree, the moment
// for those of the fourth. In eddies as small as the block the moment of 2 x 2 points is 5 to 20 %
// off, and 10 to 60 % if they do not turn (docs/explanation/likelihood.md). Glued blocks have the
// points of each.
//
// With the flow s(t) u(x, y),
//     Du/Dt = s^2 (u . grad) u + s' u
// and with a sum of layers, (u . grad) u + sum_k s_k' u_k.
// That the position is uncertain is left out.
#pragma once

#include "driftwalk/infer/expected_drag.hpp"

DRIFTWALK_LANES_BEGIN

// Value, slope and bend of the four B-splines along an axis.
struct SplineAxis {
  double value[4], slope[4], bend[4]; // [1, 1/m, 1/m^2]
  int cell;
};

inline SplineAxis spline_axis(double position, double origin, double spacing, int nodes) {
  const double raw = (position - origin) / spacing;
  const double place = raw > 0 ? (raw < nodes - 3 ? raw : nodes - 3) : 0;
  const double whole = __builtin_floor(place);
  const int cell = whole < nodes - 4 ? static_cast<int>(whole) : nodes - 4;
  const double t = place - cell, t2 = t * t, t3 = t2 * t;
  // Beyond the grid the value at its edge goes on.
  const double per = place == raw ? 1 / spacing : 0, per2 = per * per;
  return {{(1 - 3 * t + 3 * t2 - t3) * sixth, (4 - 6 * t2 + 3 * t3) * sixth,
           (1 + 3 * t + 3 * t2 - 3 * t3) * sixth, t3 * sixth},
          {per * (-1 + 2 * t - t2) * 0.5, per * (-4 * t + 3 * t2) * 0.5,
           per * (1 + 2 * t - 3 * t2) * 0.5, per * t2 * 0.5},
          {per2 * (1 - t), per2 * (3 * t - 2), per2 * (1 - 3 * t), per2 * t},
          cell};
}

// The flow at a point, without its strength: [component], [component][along], and its second
// derivatives [component][xx, xy, yy].
struct FlowAtPoint {
  double value[2];
  double slope[2][2];
  double bend[2][3];
};

inline FlowAtPoint flow_at_point(const SplineView& flow, const SplineAxis& x, const SplineAxis& y) {
  FlowAtPoint at{};
  const double* const corner =
      flow.nodes + 2 * (std::int64_t(y.cell) * flow.columns + std::int64_t(x.cell));
  for (int row = 0; row < 4; ++row) {
    const double* const nodes = corner + 2 * std::int64_t(row) * flow.columns;
    for (int c = 0; c < 2; ++c) {
      double value = 0, slope = 0, bend = 0;
      for (int column = 0; column < 4; ++column) {
        const double node = nodes[2 * column + c];
        value += node * x.value[column];
        slope += node * x.slope[column];
        bend += node * x.bend[column];
      }
      at.value[c] += y.value[row] * value;
      at.slope[c][0] += y.value[row] * slope;
      at.slope[c][1] += y.slope[row] * value;
      at.bend[c][0] += y.value[row] * bend;
      at.bend[c][1] += y.slope[row] * slope;
      at.bend[c][2] += y.bend[row] * value;
    }
  }
  return at;
}

// Du/Dt at a point and its derivatives by the place, and by the flow's value and slopes there.
struct AccelerationAtPoint {
  double value[2];
  double by_place[2][2];
  double by_flow[2][2]; // of the spline's value
  double by_slope;      // of the spline's derivative along the flow, the same axis only
};

inline AccelerationAtPoint acceleration_at_point(const FlowAtPoint& at, double strength,
                                                 double rate) {
  const double square = strength * strength;
  AccelerationAtPoint out{};
  out.by_slope = square;
  for (int a = 0; a < 2; ++a) {
    out.value[a] = rate * at.value[a];
    out.by_flow[a][a] = rate;
    for (int c = 0; c < 2; ++c) {
      out.value[a] += square * at.value[c] * at.slope[a][c];
      out.by_flow[a][c] += square * at.slope[a][c];
      out.by_place[a][c] += rate * at.slope[a][c];
      for (int b = 0; b < 2; ++b) {
        out.by_place[a][b] +=
            square * (at.slope[c][b] * at.slope[a][c] + at.value[c] * at.bend[a][b + c]);
      }
    }
  }
  return out;
}

template <int D>
inline void keep_point(const FlowAtPoint& at, const SplineAxis& x, const SplineAxis& y, int columns,
                       const AccelerationAtPoint& push, const double (&factor)[D][2],
                       PointShare<D>& share) {
  for (int a = 0; a < D; ++a) {
    for (int c = 0; c < 2; ++c) {
      share.by_rate[a][c] = factor[a][c];
      share.by_value[a][c] = factor[a][0] * push.by_flow[0][c] + factor[a][1] * push.by_flow[1][c];
      share.by_slope[a][c] = factor[a][c] * push.by_slope;
    }
  }
  share.u = at.value[0];
  share.v = at.value[1];
  for (int k = 0; k < 4; ++k) {
    share.weight_x[k] = x.value[k];
    share.weight_y[k] = y.value[k];
    share.slope_x[k] = x.slope[k];
    share.slope_y[k] = y.slope[k];
  }
  share.node = y.cell * columns + x.cell;
}

// Adds the push to the drag's response; cosine and sine are those of the block's angle.
// `rate_nodes`, if not null, are those of the derivative of the flow by time, its strength aside.
// `points`, if not null, takes what each point contributes to the derivative by the coefficients.
template <int D>
inline void add_water_acceleration(const SplineView& flow, const double* rate_nodes,
                                   const StripBlock& block, const ForceLaw& law, double cosine,
                                   double sine, const UncertainBlock<D>& state,
                                   PointShare<D>* points, DragResponse<D>& response) {
  if (law.water_acceleration == 0 && law.water_spin == 0) {
    return;
  }
  for (int k = 0; k < block.points; ++k) {
    const double *const point = block.point + 3 * k, across = point[0], along = point[1];
    const double arm_x = cosine * across - sine * along, arm_y = sine * across + cosine * along;
    const double share = law.water_acceleration * point[2];
    const double spin = law.water_spin * point[2] * block.mass_by_inertia;
    const SplineAxis x = spline_axis(state.x + arm_x, flow.origin_x, flow.spacing, flow.columns);
    const SplineAxis y = spline_axis(state.y + arm_y, flow.origin_y, flow.spacing, flow.rows);
    const FlowAtPoint at = flow_at_point(flow, x, y);
    AccelerationAtPoint push = acceleration_at_point(at, state.strength, state.strength_rate);
    if (rate_nodes != nullptr) {
      SplineView rate_flow = flow;
      rate_flow.nodes = rate_nodes;
      const FlowAtPoint rate = flow_at_point(rate_flow, x, y);
      for (int a = 0; a < 2; ++a) {
        push.value[a] += rate.value[a];
        for (int c = 0; c < 2; ++c) {
          push.by_place[a][c] += rate.slope[a][c];
        }
      }
    }
    // Of the axes' accelerations by those of the water.
    double factor[D][2] = {{share, 0}, {0, share}};
    if constexpr (D == 3) {
      factor[2][0] = -spin * arm_y;
      factor[2][1] = spin * arm_x;
    }
    for (int a = 0; a < D; ++a) {
      for (int c = 0; c < 2; ++c) {
        response.acceleration[a] += factor[a][c] * push.value[c];
        response.by_position[a][0] += factor[a][c] * push.by_place[c][0];
        response.by_position[a][1] += factor[a][c] * push.by_place[c][1];
      }
    }
    if constexpr (D == 3) {
      // The points turn with the block, and their arms with them.
      for (int a = 0; a < D; ++a) {
        for (int c = 0; c < 2; ++c) {
          response.by_position[a][2] +=
              factor[a][c] * (push.by_place[c][1] * arm_x - push.by_place[c][0] * arm_y);
        }
      }
      response.by_position[2][2] -= spin * (arm_x * push.value[0] + arm_y * push.value[1]);
    }
    if (points != nullptr) {
      keep_point<D>(at, x, y, flow.columns, push, factor, points[k]);
    }
  }
  response.points = block.points;
}

DRIFTWALK_LANES_END
