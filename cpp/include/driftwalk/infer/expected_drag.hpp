// The mean of the strip drag over an uncertain state, in closed form, and its derivatives.
//
// A strip with outward normal n and tangent t, at r from the centre, moves through the water with
// w = u(position + r) - velocity - omega J r, J a quarter turn. Its closing speed is s = -n.w, its
// slip w_t = t.w, and its force is the law's. Seen in the block's own frame, to first order,
//     dw = grad u dposition - dvelocity - J r domega - q dtheta,  q = J w - grad u J r - omega r
// so with a normal state of covariance P, (s, w_t) are normal too, and the law has their moments
// (physics/drag_law.hpp).
// Derivatives by velocities are exact for a given P where the angle is known; those by coordinates
// and coefficients leave out that dw moves with them, which is zero where only the velocities are
// uncertain. With the angle known to a degree they are off by 0.3 % (force) and 2 % (torque) at
// most, and that an uncertain angle turns the force, left out too, is some 1e-4 of it.
#pragma once

#include "driftwalk/infer/spline_flow.hpp"
#include "driftwalk/physics/drag_law.hpp"

DRIFTWALK_LANES_BEGIN

// D = 2: the covariance is that of (x, y, vx, vy), theta and omega are known. D = 3: of (x, y,
// theta, vx, vy, omega).
template <int D>
struct UncertainBlock {
  double x, y, vx, vy, omega;
  const double (*covariance)[2 * D]; // symmetric
  double strength = 1;               // of the flow
  double strength_rate = 0;          // its derivative [1/s]
};

struct Side {
  double nx, ny; // outward normal; the tangent is (-ny, nx)
};

// How w at a strip moves with the state, along one direction: one number a coordinate and velocity.
template <int D>
struct AlongState {
  Eight by[2 * D];
};

// variance = n' P n, cross = - n' P t: of the closing speed, and of it and the slip.
template <int D>
inline void spread_of(const double (*P)[2 * D], const AlongState<D>& n, const AlongState<D>& t,
                      Eight& variance, Eight& cross) {
  variance = cross = Eight(0);
  for (int a = 0; a < 2 * D; ++a) {
    Eight row = P[a][0] * n.by[0];
    for (int b = 1; b < 2 * D; ++b) {
      row += P[a][b] * n.by[b];
    }
    variance += n.by[a] * row;
    cross -= t.by[a] * row;
  }
}

template <int D>
struct DragSumsOfEight {
  Eight acceleration[D];
  Eight by_position[D][D];
  Eight by_velocity[D][D];
  Eight bend[D][D][D]; // second derivatives by velocities, [axis][b][c], b <= c
};

// Adds the second derivatives of the drag of a strip by the velocities. Its forces along -n and t
// are f and g w_t.
template <int D>
inline void add_bend(const Eight (&closing)[D], const Eight (&slip)[D], const StripMoments& m,
                     const Eight (&by_force)[D], const Eight (&by_slip)[D],
                     DragSumsOfEight<D>& sums) {
  for (int b = 0; b < D; ++b) {
    for (int c = b; c < D; ++c) {
      const Eight both = closing[b] * closing[c];
      const Eight force = m.bend_force * both;
      const Eight slip_force =
          m.bend_slip * both + m.slope * (closing[b] * slip[c] + slip[b] * closing[c]);
      for (int a = 0; a < D; ++a) {
        sums.bend[a][b][c] += by_force[a] * force + by_slip[a] * slip_force;
      }
    }
  }
}

template <int D>
inline void keep_shares(const StripsOnGrid& grid, const Eight (&response)[D][2], double strength,
                        Eight::Mask part, StripShare<D>* shares, int& count) {
  for (int lane = 0; lane < 8; ++lane) {
    if (!part[lane]) {
      continue;
    }
    StripShare<D>& share = shares[count++];
    for (int a = 0; a < D; ++a) {
      share.response[a][0] = strength * response[a][0][lane];
      share.response[a][1] = strength * response[a][1][lane];
    }
    for (int k = 0; k < 4; ++k) {
      share.weight_y[k] = grid.weight_y[k][lane];
    }
    share.along_x = grid.along_x[lane];
    share.node = grid.node[lane];
  }
}

// What the drag of the law is multiplied with for another power p of the speed: (R / reference)^(p
// - 2). R^2 is not |w|^2 of the mean alone, but such that the mean drag is right: with V the
// variance of both components and e = p/2 - 1 it grows by (2 + e) V where |w|^2 is much larger than
// V (second order in w), and by (Gamma((p + 3)/2) / Gamma(5/2))^(1/e) V where the mean of w is
// nearly zero (of two faces that are both sometimes windward): `at_rest`.
struct SpeedFactor {
  Eight factor;
  Eight slope; // minus d(ln factor)/d(velocity) over w
};

inline SpeedFactor speed_factor(const DragPower& power, Eight square, Eight variance) {
  const double e = power.power / 2 - 1;
  const double change = 2 + e - power.at_rest;
  const Eight share = square / (square + variance);
  const Eight whole = square + variance * (power.at_rest + change * share);
  const Eight grows = 1.0 + change * ((1 - share) * (1 - share));
  double factor[8];
  for (int lane = 0; lane < 8; ++lane) {
    factor[lane] = __builtin_pow(whole[lane] / (power.reference * power.reference), e);
  }
  return {Eight::load(factor), 2 * e * grows / whole};
}

inline constexpr double lane_numbers[8] = {0, 1, 2, 3, 4, 5, 6, 7};

// Eight strips with outward normals (nx, ny), h from the centre along them and `offset` along the
// tangents; one number for all of them, or one for each.
template <class Number>
struct Strips {
  Number nx, ny, h;
  Eight offset, scale;
  Eight::Mask real;
};

// `shares` may be null.
template <int D, class Number, DragLawWithMoments Law>
inline void add_strips(const Law& law, const DragPower& power, const SplineView& flow,
                       const StripBlock& block, const UncertainBlock<D>& state,
                       const Strips<Number>& strips, DragSumsOfEight<D>& sums,
                       StripShare<D>* shares, int& count) {
  const Number nx = strips.nx, ny = strips.ny, tx = -ny, ty = nx, h = strips.h;
  const Eight offset = strips.offset;
  const Eight arm_x = nx * h + tx * offset, arm_y = ny * h + ty * offset;
  StripsOnGrid grid;
  FlowAtStrips at = flow_at_strips(flow, state.x + arm_x, state.y + arm_y, grid);
  Eight* const numbers[] = {&at.u, &at.v, &at.u_x, &at.u_y, &at.v_x, &at.v_y};
  for (Eight* number : numbers) {
    *number *= state.strength;
  }
  const Eight wx = at.u - (state.vx - state.omega * arm_y);
  const Eight wy = at.v - (state.vy + state.omega * arm_x);
  // q of the head of this file.
  const Eight turn_x = at.u_x * arm_y - at.u_y * arm_x - wy - state.omega * arm_x;
  const Eight turn_y = at.v_x * arm_y - at.v_y * arm_x + wx - state.omega * arm_y;
  AlongState<D> along_n, along_t;
  along_n.by[0] = nx * at.u_x + ny * at.v_x;
  along_n.by[1] = nx * at.u_y + ny * at.v_y;
  along_t.by[0] = tx * at.u_x + ty * at.v_x;
  along_t.by[1] = tx * at.u_y + ty * at.v_y;
  along_n.by[D] = Eight(-nx);
  along_n.by[D + 1] = Eight(-ny);
  along_t.by[D] = Eight(-tx);
  along_t.by[D + 1] = Eight(-ty);
  if constexpr (D == 3) {
    along_n.by[2] = -(nx * turn_x + ny * turn_y);
    along_t.by[2] = -(tx * turn_x + ty * turn_y);
    along_n.by[5] = offset;
    along_t.by[5] = Eight(-h);
  }
  Eight variance, cross;
  spread_of<D>(state.covariance, along_n, along_t, variance, cross);
  const Eight slip = tx * wx + ty * wy;
  const StripMoments m = law.moments(-(nx * wx + ny * wy), slip, variance, cross);
  const Eight::Mask part = m.takes_part & strips.real;
  if (!any(part)) {
    return;
  }
  Eight K = select(part, strips.scale, Eight(0));
  SpeedFactor speed{Eight(1), Eight(0)};
  if (power.power != 2) {
    Eight slip_variance, unused;
    spread_of<D>(state.covariance, along_t, along_n, slip_variance, unused);
    // Known exactly it has no variance; the floor stands for 1 um/s.
    speed = speed_factor(power, wx * wx + wy * wy, at_least(variance + slip_variance, 1e-12));
    K *= speed.factor;
  }
  const Eight along_normal = K * m.force, along_tangent = K * m.slip_force;
  const Eight force[2] = {tx * along_tangent - nx * along_normal,
                          ty * along_tangent - ny * along_normal};
  sums.acceleration[0] += force[0];
  sums.acceleration[1] += force[1];
  // d(acceleration)/d(velocity) = E[g' w] n' - E[g] I, with w = -s n + w_t t.
  const Eight conductance = K * m.conductance;
  const Eight slope_force = K * m.slope_force, slope_slip = K * m.slope_slip;
  const Eight mean_x = tx * slope_slip - nx * slope_force,
              mean_y = ty * slope_slip - ny * slope_force;
  Eight response[D][2];
  response[0][0] = mean_x * nx - conductance;
  response[0][1] = mean_x * ny;
  response[1][0] = mean_y * nx;
  response[1][1] = mean_y * ny - conductance;
  if (power.power != 2) {
    for (int a = 0; a < 2; ++a) {
      response[a][0] -= force[a] * speed.slope * wx;
      response[a][1] -= force[a] * speed.slope * wy;
    }
  }
  if constexpr (D == 3) {
    const Eight lever_x = block.mass_by_inertia * arm_x, lever_y = block.mass_by_inertia * arm_y;
    sums.acceleration[2] += lever_x * force[1] - lever_y * force[0];
    response[2][0] = lever_x * response[1][0] - lever_y * response[0][0];
    response[2][1] = lever_x * response[1][1] - lever_y * response[0][1];
    sums.by_position[0][2] -= force[1];
    sums.by_position[1][2] += force[0];
  }
  for (int a = 0; a < D; ++a) {
    const Eight x = response[a][0], y = response[a][1];
    sums.by_velocity[a][0] += x;
    sums.by_velocity[a][1] += y;
    sums.by_position[a][0] -= x * at.u_x + y * at.v_x;
    sums.by_position[a][1] -= x * at.u_y + y * at.v_y;
    if constexpr (D == 3) {
      sums.by_velocity[a][2] += y * arm_x - x * arm_y;
      sums.by_position[a][2] += x * turn_x + y * turn_y;
    }
  }
  Eight closing_by[D], slip_by[D], by_force[D], by_slip[D];
  closing_by[0] = Eight(nx);
  closing_by[1] = Eight(ny);
  slip_by[0] = Eight(-tx);
  slip_by[1] = Eight(-ty);
  by_force[0] = -nx * K;
  by_force[1] = -ny * K;
  by_slip[0] = tx * K;
  by_slip[1] = ty * K;
  if constexpr (D == 3) {
    closing_by[2] = -offset;
    slip_by[2] = Eight(-h);
    by_force[2] = block.mass_by_inertia * offset * K;
    by_slip[2] = block.mass_by_inertia * h * K;
  }
  add_bend<D>(closing_by, slip_by, m, by_force, by_slip, sums);
  if (shares != nullptr) {
    keep_shares<D>(grid, response, state.strength, part, shares, count);
  }
}

// One orientation of the body: its panels, or the four sides of the block.
template <int D, DragLawWithMoments Law>
inline void add_orientation(const Law& law, const DragPower& power, const SplineView& flow,
                            const StripBlock& block, const UncertainBlock<D>& state, double cosine,
                            double sine, double scale, DragSumsOfEight<D>& sums,
                            StripShare<D>* shares, int& count) {
  for (int row = 0; row < block.panels.count; ++row) {
    const double* const panel = block.panels.rows + 48 * row;
    const Eight x = Eight::load(panel), y = Eight::load(panel + 8);
    const Eight nx = Eight::load(panel + 16), ny = Eight::load(panel + 24);
    const Strips<Eight> strips{cosine * nx - sine * ny,
                               sine * nx + cosine * ny,
                               nx * x + ny * y,
                               nx * y - ny * x,
                               Eight::load(panel + 32) * scale,
                               Eight(0.5) < Eight::load(panel + 40)};
    add_strips<D>(law, power, flow, block, state, strips, sums, shares, count);
  }
  const double h = block.half_side;
  Side side{cosine, sine};
  for (int k = 0; k < 4 && block.panels.count == 0; ++k) {
    for (int first = 0; first < block.strips; first += 8) {
      const Eight strip = Eight::load(lane_numbers) + first;
      const Eight::Mask real = strip < block.strips;
      const Eight offset = (select(real, strip, Eight(0)) + 0.5) * block.strip_width - h;
      const Strips<double> strips{side.nx, side.ny, h, offset, Eight(scale), real};
      add_strips<D>(law, power, flow, block, state, strips, sums, shares, count);
    }
    side = {-side.ny, side.nx};
  }
}

// The drag at angle `theta`, or averaged over the orientations, without turning, if there are any.
// `shares`, if not null, takes what each strip contributes to the derivative by the coefficients.
template <int D, DragLawWithMoments Law>
inline DragResponse<D> expected_drag(const Law& law, const DragPower& power, const SplineView& flow,
                                     const StripBlock& block, const Orientations& orientations,
                                     double theta, const UncertainBlock<D>& state,
                                     StripShare<D>* shares) {
  DragSumsOfEight<D> sums;
  for (int a = 0; a < D; ++a) {
    sums.acceleration[a] = Eight(0);
    for (int b = 0; b < D; ++b) {
      sums.by_position[a][b] = sums.by_velocity[a][b] = Eight(0);
      for (int c = b; c < D; ++c) {
        sums.bend[a][b][c] = Eight(0);
      }
    }
  }
  DragResponse<D> response;
  response.shares = response.points = 0;
  if (orientations.count == 0) {
    add_orientation<D>(law, power, flow, block, state, __builtin_cos(theta), __builtin_sin(theta),
                       block.drag_scale, sums, shares, response.shares);
  }
  UncertainBlock<D> still = state;
  still.omega = 0;
  for (int k = 0; k < orientations.count; ++k) {
    add_orientation<D>(law, power, flow, block, still, orientations.cosine[k], orientations.sine[k],
                       block.drag_scale / orientations.count, sums, shares, response.shares);
  }
  for (int a = 0; a < D; ++a) {
    response.acceleration[a] = response.drag[a] = sum(sums.acceleration[a]);
    for (int b = 0; b < D; ++b) {
      response.by_position[a][b] = sum(sums.by_position[a][b]);
      response.by_velocity[a][b] = sum(sums.by_velocity[a][b]);
      for (int c = b; c < D; ++c) {
        response.bend[a][b][c] = response.bend[a][c][b] = sum(sums.bend[a][b][c]);
      }
    }
  }
  return response;
}

DRIFTWALK_LANES_END
