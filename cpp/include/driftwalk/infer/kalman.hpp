// Mean and covariance of (x, y, vx, vy) through a drift, a kick and a sample.
#pragma once

#include "driftwalk/config.hpp"
#include "driftwalk/infer/problem.hpp"

DRIFTWALK_LANES_BEGIN

using Matrix2 = double[2][2];
using Matrix4 = double[4][4];

// Positions move by `dt` times the velocities.
inline void drift_mean(double mean[4], double dt) {
  mean[0] += dt * mean[2];
  mean[1] += dt * mean[3];
}
inline void drift_covariance(Matrix4& P, double dt) {
  for (int a = 0; a < 2; ++a) {
    for (int b = 0; b < 4; ++b) {
      P[a][b] += dt * P[a + 2][b];
    }
  }
  for (int a = 0; a < 4; ++a) {
    for (int b = 0; b < 2; ++b) {
      P[a][b] += dt * P[a][b + 2];
    }
  }
}

// A linearly implicit kick: v' = v + h W a with W = (I - h/2 da/dv)^-1, and its derivatives with W
// held fixed, as the gain of the filter is.
struct Kick {
  Matrix2 inverse;     // W
  double change[2];    // of the velocity
  Matrix2 by_position; // d(v')/d(position)
  Matrix2 by_velocity; // d(v')/d(v)
};

inline Kick make_kick(const DragResponse& drag, double h) {
  const double a = 1 - h / 2 * drag.by_velocity[0][0], b = -h / 2 * drag.by_velocity[0][1];
  const double c = -h / 2 * drag.by_velocity[1][0], d = 1 - h / 2 * drag.by_velocity[1][1];
  const double determinant = a * d - b * c;
  Kick kick{{{d / determinant, -b / determinant}, {-c / determinant, a / determinant}}, {}, {}, {}};
  for (int i = 0; i < 2; ++i) {
    const double wx = h * kick.inverse[i][0], wy = h * kick.inverse[i][1];
    kick.change[i] = wx * drag.acceleration[0] + wy * drag.acceleration[1];
    for (int j = 0; j < 2; ++j) {
      kick.by_position[i][j] = wx * drag.by_position[0][j] + wy * drag.by_position[1][j];
      kick.by_velocity[i][j] =
          (i == j ? 1 : 0) + wx * drag.by_velocity[0][j] + wy * drag.by_velocity[1][j];
    }
  }
  return kick;
}

inline void kick_covariance(Matrix4& P, const Kick& kick) {
  const Matrix2 &X = kick.by_position, &V = kick.by_velocity;
  for (int b = 0; b < 4; ++b) {
    const double x = P[0][b], y = P[1][b], vx = P[2][b], vy = P[3][b];
    P[2][b] = X[0][0] * x + X[0][1] * y + V[0][0] * vx + V[0][1] * vy;
    P[3][b] = X[1][0] * x + X[1][1] * y + V[1][0] * vx + V[1][1] * vy;
  }
  for (int a = 0; a < 4; ++a) {
    const double x = P[a][0], y = P[a][1], vx = P[a][2], vy = P[a][3];
    P[a][2] = X[0][0] * x + X[0][1] * y + V[0][0] * vx + V[0][1] * vy;
    P[a][3] = X[1][0] * x + X[1][1] * y + V[1][0] * vx + V[1][1] * vy;
  }
}

// White acceleration of intensity q over a step h, damped by W as the kick is. Without W the force
// came out up to 6 % low.
inline void add_noise(Matrix4& P, const Matrix2& W, double q, double h) {
  const double position = q * h * h * h / 3, mixed = q * h * h / 2, velocity = q * h;
  for (int a = 0; a < 2; ++a) {
    for (int b = 0; b < 2; ++b) {
      const double damped = W[a][0] * W[b][0] + W[a][1] * W[b][1];
      P[a][b] += position * damped;
      P[a][b + 2] += mixed * damped;
      P[a + 2][b] += mixed * damped;
      P[a + 2][b + 2] += velocity * damped;
    }
  }
}

// The innovation of a sample and its covariance S.
struct Innovation {
  double x, y;
  double xx, xy, yy; // S

  double determinant() const { return xx * yy - xy * xy; }
  double chi_squared() const { return (yy * x * x - 2 * xy * x * y + xx * y * y) / determinant(); }
};

inline Innovation innovation_of(const FilterState& state, double x, double y, double variance) {
  const Matrix4& P = state.covariance;
  return {x - state.mean[0], y - state.mean[1], P[0][0] + variance, P[0][1], P[1][1] + variance};
}

// L^-1, L L' = S: x / l_xx and (y - l_yx x) / l_yy, with x the first result.
struct Whitening {
  double per_xx, yx, per_yy;
};

inline Whitening whitening_of(const Innovation& e) {
  const double lxx = __builtin_sqrt(e.xx), lyx = e.xy / lxx;
  return {1 / lxx, lyx, 1 / __builtin_sqrt(e.yy - lyx * lyx)};
}

// K = P H' S^-1
struct Gain {
  double by_x[4], by_y[4];
};

inline Gain gain_of(const Matrix4& P, const Innovation& e) {
  const double determinant = e.determinant();
  const double xx = e.yy / determinant, xy = -e.xy / determinant, yy = e.xx / determinant;
  Gain gain;
  for (int a = 0; a < 4; ++a) {
    gain.by_x[a] = P[a][0] * xx + P[a][1] * xy;
    gain.by_y[a] = P[a][0] * xy + P[a][1] * yy;
  }
  return gain;
}

inline void update(FilterState& state, const Innovation& e, const Gain& gain) {
  Matrix4 after;
  for (int a = 0; a < 4; ++a) {
    state.mean[a] += gain.by_x[a] * e.x + gain.by_y[a] * e.y;
    for (int b = 0; b < 4; ++b) {
      after[a][b] = state.covariance[a][b] - gain.by_x[a] * state.covariance[0][b] -
                    gain.by_y[a] * state.covariance[1][b];
    }
  }
  for (int a = 0; a < 4; ++a) {
    for (int b = 0; b < 4; ++b) {
      state.covariance[a][b] = 0.5 * (after[a][b] + after[b][a]);
    }
  }
}

DRIFTWALK_LANES_END
