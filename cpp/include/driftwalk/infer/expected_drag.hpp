// The mean of the strip drag over an uncertain position and velocity, in closed form, and its
// derivatives.
//
// A strip with outward normal n and tangent t moves through the water with w = u - v (block). Its
// closing speed is s = -n.w, its slip w_t = t.w, and its force max(0, s) w. With (position,
// velocity) normal of covariance P, w is normal to first order with covariance B P B', B = [grad u,
// -I]. For s ~ N(m, tau^2), c = cov(s, w_t), and phi, Phi at m / tau:
//     E[s+]        = m Phi + tau phi
//     E[s+^2]      = (m^2 + tau^2) Phi + m tau phi
//     E[s+ w_t]    = w_t E[s+] + c Phi
//     E[w_t; s>0]  = w_t Phi + c phi / tau
// Derivatives by velocity are exact for a given P; those by position and coefficients leave out
// that B moves with them, which is zero where only the velocity is uncertain.
#pragma once

#include "driftwalk/infer/normal.hpp"
#include "driftwalk/infer/spline_flow.hpp"

DRIFTWALK_LANES_BEGIN

struct UncertainBlock {
  double x, y, vx, vy, omega;
  const double (*covariance)[4]; // of (x, y, vx, vy), symmetric
};

struct Side {
  double nx, ny; // outward normal; the tangent is (-ny, nx)
};

// Covariance of position and velocity as a side sees it.
struct SideCovariance {
  double xx, xy, yy;           // of the position
  double x_normal, y_normal;   // of position and normal velocity
  double x_tangent, y_tangent; // of position and tangential velocity
  double normal, cross;        // of the normal velocity; of normal and tangential
};

inline SideCovariance side_covariance(const double P[4][4], Side side) {
  const double nx = side.nx, ny = side.ny, tx = -ny, ty = nx;
  const double normal_x = P[2][2] * nx + P[2][3] * ny, normal_y = P[2][3] * nx + P[3][3] * ny;
  return {P[0][0],
          P[0][1],
          P[1][1],
          P[0][2] * nx + P[0][3] * ny,
          P[1][2] * nx + P[1][3] * ny,
          P[0][2] * tx + P[0][3] * ty,
          P[1][2] * tx + P[1][3] * ty,
          nx * normal_x + ny * normal_y,
          tx * normal_x + ty * normal_y};
}

// Moments of the closing speed and the slip of the strips of a side.
struct StripMoments {
  Eight closing;       // E[s+]
  Eight square;        // E[s+^2]
  Eight closing_slip;  // E[s+ w_t]
  Eight windward_slip; // E[w_t; s > 0]
  Eight::Mask takes_part;
};

inline StripMoments strip_moments(Eight mean, Eight slip, Eight variance, Eight cross) {
  // A block that is known exactly has tau = 0; the floor stands for it, at 10 nm/s.
  const Eight tau = square_root(at_least(variance, 1e-16));
  const Eight z = mean / tau;
  const NormalLaw law = normal_law(z);
  StripMoments m;
  m.closing = mean * law.probability + tau * law.density;
  m.square = (mean * mean + variance) * law.probability + mean * (tau * law.density);
  m.closing_slip = slip * m.closing + cross * law.probability;
  m.windward_slip = slip * law.probability + cross * law.density / tau;
  m.takes_part = z > -normal_reach;
  return m;
}

struct DragSumsOfEight {
  Eight acceleration[2];
  Eight by_position[2][2];
  Eight by_velocity[2][2];
};

inline void keep_shares(const StripsOnGrid& grid, const Eight response[2][2], Eight::Mask part,
                        StripShare* shares, int& count) {
  for (int lane = 0; lane < 8; ++lane) {
    if (!part[lane]) {
      continue;
    }
    StripShare& share = shares[count++];
    for (int k = 0; k < 4; ++k) {
      share.response[k] = response[k / 2][k % 2][lane];
      share.weight_y[k] = grid.weight_y[k][lane];
    }
    share.along_x = grid.along_x[lane];
    share.node = grid.node[lane];
  }
}

inline constexpr double lane_numbers[8] = {0, 1, 2, 3, 4, 5, 6, 7};

// Strips `first` .. `first + 7` of a side; `shares` may be null.
inline void add_strips(const SplineView& flow, const StripBlock& block, const UncertainBlock& state,
                       Side side, int first, double scale, DragSumsOfEight& sums,
                       StripShare* shares, int& count) {
  const double nx = side.nx, ny = side.ny, tx = -ny, ty = nx, h = block.half_side;
  const Eight strip = Eight::load(lane_numbers) + first;
  const Eight::Mask real = strip < block.strips;
  const Eight offset = (select(real, strip, Eight(0)) + 0.5) * block.strip_width - h;
  const Eight arm_x = nx * h + tx * offset, arm_y = ny * h + ty * offset;
  StripsOnGrid grid;
  const FlowAtStrips at = flow_at_strips(flow, state.x + arm_x, state.y + arm_y, grid);
  const Eight wx = at.u - (state.vx - state.omega * arm_y);
  const Eight wy = at.v - (state.vy + state.omega * arm_x);
  // Gradients of the flow along the normal and along the tangent.
  const Eight gnx = nx * at.u_x + ny * at.v_x, gny = nx * at.u_y + ny * at.v_y;
  const Eight gtx = tx * at.u_x + ty * at.v_x, gty = tx * at.u_y + ty * at.v_y;
  const SideCovariance c = side_covariance(state.covariance, side);
  const Eight px = c.xx * gnx + c.xy * gny, py = c.xy * gnx + c.yy * gny;
  const Eight variance = gnx * (px - 2 * c.x_normal) + gny * (py - 2 * c.y_normal) + c.normal;
  const Eight cross = -(gtx * (px - c.x_normal) + gty * (py - c.y_normal) -
                        (gnx * c.x_tangent + gny * c.y_tangent) + c.cross);
  const Eight slip = tx * wx + ty * wy;
  const StripMoments m = strip_moments(-(nx * wx + ny * wy), slip, variance, cross);
  const Eight::Mask part = m.takes_part & real;
  if (!any(part)) {
    return;
  }
  const Eight K = select(part, Eight(scale), Eight(0));
  const Eight along_normal = K * m.square, along_tangent = K * m.closing_slip;
  sums.acceleration[0] += tx * along_tangent - nx * along_normal;
  sums.acceleration[1] += ty * along_tangent - ny * along_normal;
  // d(acceleration)/d(velocity) = E[w n'; s > 0] - E[s+] I, with w = -s n + w_t t.
  const Eight closing = K * m.closing, windward_slip = K * m.windward_slip;
  const Eight mean_x = tx * windward_slip - nx * closing,
              mean_y = ty * windward_slip - ny * closing;
  const Eight response[2][2] = {{mean_x * nx - closing, mean_x * ny},
                                {mean_y * nx, mean_y * ny - closing}};
  for (int a = 0; a < 2; ++a) {
    for (int b = 0; b < 2; ++b) {
      sums.by_velocity[a][b] += response[a][b];
    }
    sums.by_position[a][0] -= response[a][0] * at.u_x + response[a][1] * at.v_x;
    sums.by_position[a][1] -= response[a][0] * at.u_y + response[a][1] * at.v_y;
  }
  if (shares != nullptr) {
    keep_shares(grid, response, part, shares, count);
  }
}

// One orientation of the block, its four sides.
inline void add_orientation(const SplineView& flow, const StripBlock& block,
                            const UncertainBlock& state, double cosine, double sine, double scale,
                            DragSumsOfEight& sums, StripShare* shares, int& count) {
  Side side{cosine, sine};
  for (int k = 0; k < 4; ++k) {
    for (int first = 0; first < block.strips; first += 8) {
      add_strips(flow, block, state, side, first, scale, sums, shares, count);
    }
    side = {-side.ny, side.nx};
  }
}

// The drag at angle `theta`, or averaged over the orientations, without turning, if there are any.
// `shares`, if not null, takes what each strip contributes to the derivative by the coefficients.
inline DragResponse expected_drag(const SplineView& flow, const StripBlock& block,
                                  const Orientations& orientations, double theta,
                                  const UncertainBlock& state, StripShare* shares) {
  DragSumsOfEight sums{{0, 0}, {{0, 0}, {0, 0}}, {{0, 0}, {0, 0}}};
  DragResponse response;
  response.shares = 0;
  if (orientations.count == 0) {
    add_orientation(flow, block, state, __builtin_cos(theta), __builtin_sin(theta),
                    block.drag_scale, sums, shares, response.shares);
  }
  UncertainBlock still = state;
  still.omega = 0;
  for (int k = 0; k < orientations.count; ++k) {
    add_orientation(flow, block, still, orientations.cosine[k], orientations.sine[k],
                    block.drag_scale / orientations.count, sums, shares, response.shares);
  }
  for (int a = 0; a < 2; ++a) {
    response.acceleration[a] = sum(sums.acceleration[a]);
    for (int b = 0; b < 2; ++b) {
      response.by_position[a][b] = sum(sums.by_position[a][b]);
      response.by_velocity[a][b] = sum(sums.by_velocity[a][b]);
    }
  }
  return response;
}

DRIFTWALK_LANES_END
