// The water's own acceleration Du/Dt = (u . grad) u + du/dt pushes what floats in it:
//
//     (m + m_a) dv/dt     = (m_w + m_a) A     + drag + stochastic force
//     (I + I_a) domega/dt = (I_w + I_a) alpha + torque of the drag
//
// m_a is the added mass, m_w the mass of the displaced water. A is the mean of Du/Dt at four
// points, a/sqrt(12) from the middle of the block along x and along y, and alpha = 6/a^2 mean(r x
// Du/Dt), which is half the curl. The points have the second moments of the square, which a square
// has at any angle.
#pragma once

#include "driftwalk/flow/bilinear.hpp"
#include "driftwalk/physics/body.hpp"
#include "driftwalk/simulate/prepared.hpp"

DRIFTWALK_LANES_BEGIN

// The acceleration of a block whose centre is at (x, y) by the water's: (m_w + m_a)/(m + m_a) A and
// the same for the angle.
template <class Real, class T>
inline Motion<Real> water_acceleration(const WaterView<T>& water, const BlockShape<T>& block,
                                       Real x, Real y) {
  constexpr T root_three = T(1.73205080756887729);
  FlowView<T> nodes = water.nodes;
  const T reach = block.half_side / root_three;
  const Real low_x = clamp_to(x, nodes.low_x, nodes.high_x) - Real(nodes.origin_x + reach);
  const Real low_y = clamp_to(y, nodes.low_y, nodes.high_y) - Real(nodes.origin_y + reach);
  const Real column = low_x * nodes.per_spacing_x, row = low_y * nodes.per_spacing_y;
  const Real across{T(2) * reach * nodes.per_spacing_x}, up{T(2) * reach * nodes.per_spacing_y};
  const Real zero{T(0)};
  Motion<Real> sums{zero, zero, zero};
  for (int k = 0; k < water.count; ++k) {
    Real part{water.part};
    if (water.lanes != nullptr) {
      nodes.lanes = &water.lanes->table[k];
      load_lanes(water.lanes->part[k], part);
    }
    for (int above = 0; above < 2; ++above) {
      FlowCursor<Real> cursor(nodes, column, above == 0 ? row : row + up, across, zero);
      Real left_x, left_y, right_x, right_y;
      cursor.read(left_x, left_y);
      cursor.advance();
      cursor.read(right_x, right_y);
      const Real along = left_x + right_x, turning = right_y - left_y;
      sums.vx = sums.vx + along * part;
      sums.vy = sums.vy + (left_y + right_y) * part;
      sums.omega = sums.omega + (above == 0 ? turning + along : turning - along) * part;
    }
  }
  const T mean = T(0.25) * nodes.unit * water.push;
  return {sums.vx * mean, sums.vy * mean,
          sums.omega * (root_three / (T(8) * block.half_side) * nodes.unit * water.spin)};
}

DRIFTWALK_LANES_END
