// The water's own acceleration Du/Dt = (u . grad) u + du/dt pushes what floats in it:
//
//     (m + m_a) dv/dt     = (m_w + m_a) A     + drag + stochastic force
//     (I + I_a) domega/dt = (I_w + I_a) alpha + torque of the drag
//
// m_a is the added mass, m_w the mass of the displaced water. A is the mean of Du/Dt over the
// block, and alpha = 6/a^2 mean(r x Du/Dt), half the curl where the flow is quadratic. Both are
// weighted means over the 3 x 3 Gauss points of the square, which turn with it: the moment is exact
// where Du/Dt is a polynomial of the fourth degree.
#pragma once

#include "driftwalk/flow/bilinear.hpp"
#include "driftwalk/physics/body.hpp"
#include "driftwalk/simulate/prepared.hpp"

DRIFTWALK_LANES_BEGIN

// The acceleration of a block with centre (x, y) by the water's: (m_w + m_a)/(m + m_a) A and the
// same for the angle.
template <class Real, class T>
inline Motion<Real> water_acceleration(const WaterView<T>& water, const BlockShape<T>& block,
                                       Real x, Real y, const Axes<Real>& axes) {
  constexpr T place = T(0.77459666924148338), outer = T(5.0 / 18), inner = T(8.0 / 18);
  FlowView<T> nodes = water.nodes;
  const T reach = place * block.half_side;
  const Real across_x = axes.cosine * reach, across_y = axes.sine * reach;
  const Real low_x = clamp_to(x, nodes.low_x, nodes.high_x) - Real(nodes.origin_x);
  const Real low_y = clamp_to(y, nodes.low_y, nodes.high_y) - Real(nodes.origin_y);
  // From one point of a row to the next; the rows are a quarter turn from it apart.
  const Real step_x = across_x * nodes.per_spacing_x, step_y = across_y * nodes.per_spacing_y;
  FlowRow<Real> rows[3];
  for (int row = 0; row < 3; ++row) {
    const T up = T(row - 1);
    rows[row] = {(low_x - across_x - across_y * up) * nodes.per_spacing_x,
                 (low_y - across_y + across_x * up) * nodes.per_spacing_y, step_x, step_y};
  }
  const Real zero{T(0)};
  Motion<Real> sums{zero, zero, zero};
  for (int k = 0; k < water.count; ++k) {
    Real part{water.part};
    if (water.lanes != nullptr) {
      nodes.lanes = &water.lanes->table[k];
      load_lanes(water.lanes->part[k], part);
    }
    Real u[9], v[9];
    read_rows(nodes, rows, 3, 3, u, v);
    // Of the whole, the mean; the difference of the points on either side, and of the rows.
    Real mean_x = zero, mean_y = zero, right_x = zero, right_y = zero, up_x = zero, up_y = zero;
    for (int row = 0; row < 3; ++row) {
      const Real* const ux = u + 3 * row;
      const Real* const uy = v + 3 * row;
      const T weight = row == 1 ? inner : outer;
      const Real along_x = (ux[0] + ux[2]) * outer + ux[1] * inner;
      const Real along_y = (uy[0] + uy[2]) * outer + uy[1] * inner;
      mean_x = mean_x + along_x * weight;
      mean_y = mean_y + along_y * weight;
      right_x = right_x + (ux[2] - ux[0]) * (outer * weight);
      right_y = right_y + (uy[2] - uy[0]) * (outer * weight);
      up_x = up_x + along_x * (T(row - 1) * weight);
      up_y = up_y + along_y * (T(row - 1) * weight);
    }
    sums.vx = sums.vx + mean_x * part;
    sums.vy = sums.vy + mean_y * part;
    sums.omega =
        sums.omega + (axes.cosine * (right_y - up_x) - axes.sine * (right_x + up_y)) * part;
  }
  const T mean = nodes.unit * water.push;
  // 6/a^2 times the reach of the points.
  const T turning = T(1.5) * place / block.half_side * nodes.unit * water.spin;
  return {sums.vx * mean, sums.vy * mean, sums.omega * turning};
}

DRIFTWALK_LANES_END
