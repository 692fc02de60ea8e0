// Mean and covariance of D coordinates and their velocities through a drift, a kick and a sample.
#pragma once

#include "driftwalk/config.hpp"
#include "driftwalk/infer/problem.hpp"

DRIFTWALK_LANES_BEGIN

template <int N>
using Square = double[N][N];

// Coordinates move by `dt` times their velocities.
template <int D>
inline void drift_mean(FilterState<D>& state, double dt) {
  for (int a = 0; a < D; ++a) {
    state.mean[a] += dt * state.mean[a + D];
  }
}
template <int D>
inline void drift_covariance(FilterState<D>& state, double dt) {
  Square<2 * D>& P = state.covariance;
  for (int a = 0; a < D; ++a) {
    for (int b = 0; b < 2 * D; ++b) {
      P[a][b] += dt * P[a + D][b];
    }
  }
  for (int a = 0; a < 2 * D; ++a) {
    for (int b = 0; b < D; ++b) {
      P[a][b] += dt * P[a][b + D];
    }
  }
}

inline void invert(const Square<2>& A, Square<2>& out) {
  const double determinant = A[0][0] * A[1][1] - A[0][1] * A[1][0];
  out[0][0] = A[1][1] / determinant;
  out[0][1] = -A[0][1] / determinant;
  out[1][0] = -A[1][0] / determinant;
  out[1][1] = A[0][0] / determinant;
}
inline void invert(const Square<3>& A, Square<3>& out) {
  for (int a = 0; a < 3; ++a) {
    const int b = (a + 1) % 3, c = (a + 2) % 3;
    for (int k = 0; k < 3; ++k) {
      const int l = (k + 1) % 3, m = (k + 2) % 3;
      out[k][a] = A[b][l] * A[c][m] - A[b][m] * A[c][l];
    }
  }
  const double determinant = A[0][0] * out[0][0] + A[0][1] * out[1][0] + A[0][2] * out[2][0];
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b) {
      out[a][b] /= determinant;
    }
  }
}

// A linearly implicit kick: v' = v + h W a with W = (I - h/2 da/dv)^-1, and its derivatives with W
// held fixed, as the gain of the filter is.
template <int D>
struct Kick {
  Square<D> inverse;     // W
  double change[D];      // of the velocity
  Square<D> by_position; // d(v')/d(coordinates)
  Square<D> by_velocity; // d(v')/d(v)
};

template <int D>
inline Kick<D> make_kick(const DragResponse<D>& drag, double h) {
  Square<D> implicit;
  for (int a = 0; a < D; ++a) {
    for (int b = 0; b < D; ++b) {
      implicit[a][b] = (a == b ? 1 : 0) - h / 2 * drag.by_velocity[a][b];
    }
  }
  Kick<D> kick{};
  invert(implicit, kick.inverse);
  for (int a = 0; a < D; ++a) {
    kick.by_velocity[a][a] = 1;
    for (int c = 0; c < D; ++c) {
      const double w = h * kick.inverse[a][c];
      kick.change[a] += w * drag.acceleration[c];
      for (int b = 0; b < D; ++b) {
        kick.by_position[a][b] += w * drag.by_position[c][b];
        kick.by_velocity[a][b] += w * drag.by_velocity[c][b];
      }
    }
  }
  return kick;
}

// The velocity that follows from a state's coordinates and velocities, by the linear part of a
// kick.
template <int D, class Real>
inline void kick_linear(const Kick<D>& kick, const Real (&coordinates)[D],
                        const Real (&velocities)[D], Real (&after)[D]) {
  for (int a = 0; a < D; ++a) {
    Real sum = kick.by_position[a][0] * coordinates[0];
    for (int b = 1; b < D; ++b) {
      sum = sum + kick.by_position[a][b] * coordinates[b];
    }
    for (int b = 0; b < D; ++b) {
      sum = sum + kick.by_velocity[a][b] * velocities[b];
    }
    after[a] = sum;
  }
}

template <int D>
inline void kick_covariance(FilterState<D>& state, const Kick<D>& kick) {
  Square<2 * D>& P = state.covariance;
  double coordinates[D], velocities[D], after[D];
  for (int b = 0; b < 2 * D; ++b) {
    for (int a = 0; a < D; ++a) {
      coordinates[a] = P[a][b];
      velocities[a] = P[a + D][b];
    }
    kick_linear<D, double>(kick, coordinates, velocities, after);
    for (int a = 0; a < D; ++a) {
      P[a + D][b] = after[a];
    }
  }
  for (int b = 0; b < 2 * D; ++b) {
    for (int a = 0; a < D; ++a) {
      coordinates[a] = P[b][a];
      velocities[a] = P[b][a + D];
    }
    kick_linear<D, double>(kick, coordinates, velocities, after);
    for (int a = 0; a < D; ++a) {
      P[b][a + D] = after[a];
    }
  }
}

// The covariance of what the mean and the slope of the drag leave out where velocities are
// uncertain, to second order: tr(H_a V H_b V) / 2, H the second derivatives and V the velocities'
// covariance.
template <int D>
inline void bend_covariance(const DragResponse<D>& drag, const Square<2 * D>& P, Square<D>& out) {
  Square<D> product[D]; // H_a V
  for (int a = 0; a < D; ++a) {
    for (int b = 0; b < D; ++b) {
      for (int c = 0; c < D; ++c) {
        product[a][b][c] = 0;
        for (int k = 0; k < D; ++k) {
          product[a][b][c] += drag.bend[a][b][k] * P[k + D][c + D];
        }
      }
    }
  }
  for (int a = 0; a < D; ++a) {
    for (int b = 0; b < D; ++b) {
      double trace = 0;
      for (int k = 0; k < D; ++k) {
        for (int l = 0; l < D; ++l) {
          trace += product[a][k][l] * product[b][l][k];
        }
      }
      out[a][b] = trace / 2;
    }
  }
}

// White acceleration over a step h, damped by W as the kick is. Without W the force came out up to
// 6 % low.
template <int D>
inline void add_noise(FilterState<D>& state, const Square<D>& W, const Square<D>& intensity,
                      double h) {
  Square<2 * D>& P = state.covariance;
  for (int a = 0; a < D; ++a) {
    for (int b = 0; b < D; ++b) {
      double damped = 0;
      for (int c = 0; c < D; ++c) {
        for (int d = 0; d < D; ++d) {
          damped += W[a][c] * intensity[c][d] * W[b][d];
        }
      }
      P[a][b] += h * h * h / 3 * damped;
      P[a][b + D] += h * h / 2 * damped;
      P[a + D][b] += h * h / 2 * damped;
      P[a + D][b + D] += h * damped;
    }
  }
}

// The innovation of a sample, e, its covariance S = L L', and L^-1 e.
template <int D>
struct Innovation {
  double e[D];
  Square<D> S;
  Square<D> L;        // below the diagonal
  double per_root[D]; // 1 / the diagonal of L
  double white[D];

  double chi_squared() const {
    double sum = 0;
    for (int a = 0; a < D; ++a) {
      sum += white[a] * white[a];
    }
    return sum;
  }
};

template <int D>
inline Innovation<D> innovation_of(const FilterState<D>& state, const double (&sample)[D],
                                   const double (&variance)[D]) {
  Innovation<D> out{};
  for (int a = 0; a < D; ++a) {
    out.e[a] = sample[a] - state.mean[a];
    for (int b = 0; b < D; ++b) {
      out.S[a][b] = state.covariance[a][b] + (a == b ? variance[a] : 0);
    }
  }
  for (int a = 0; a < D; ++a) {
    double rest = out.S[a][a], white = out.e[a];
    for (int b = 0; b < a; ++b) {
      double product = out.S[a][b];
      for (int c = 0; c < b; ++c) {
        product -= out.L[a][c] * out.L[b][c];
      }
      out.L[a][b] = product * out.per_root[b];
      rest -= out.L[a][b] * out.L[a][b];
      white -= out.L[a][b] * out.white[b];
    }
    out.per_root[a] = 1 / __builtin_sqrt(rest);
    out.white[a] = white * out.per_root[a];
  }
  return out;
}

// K = P H' S^-1
template <int D>
struct Gain {
  double by[2 * D][D];
};

template <int D>
inline Gain<D> gain_of(const Square<2 * D>& P, const Innovation<D>& e) {
  Gain<D> gain;
  for (int row = 0; row < 2 * D; ++row) {
    double (&g)[D] = gain.by[row];
    for (int a = 0; a < D; ++a) {
      g[a] = P[row][a];
      for (int b = 0; b < a; ++b) {
        g[a] -= e.L[a][b] * g[b];
      }
      g[a] *= e.per_root[a];
    }
    for (int a = D - 1; a >= 0; --a) {
      for (int b = a + 1; b < D; ++b) {
        g[a] -= e.L[b][a] * g[b];
      }
      g[a] *= e.per_root[a];
    }
  }
  return gain;
}

template <int D>
inline void update(FilterState<D>& state, const Innovation<D>& e, const Gain<D>& gain) {
  Square<2 * D> after;
  for (int a = 0; a < 2 * D; ++a) {
    for (int b = 0; b < 2 * D; ++b) {
      after[a][b] = state.covariance[a][b];
      for (int c = 0; c < D; ++c) {
        after[a][b] -= gain.by[a][c] * state.covariance[c][b];
      }
    }
    for (int c = 0; c < D; ++c) {
      state.mean[a] += gain.by[a][c] * e.e[c];
    }
  }
  for (int a = 0; a < 2 * D; ++a) {
    for (int b = 0; b < 2 * D; ++b) {
      state.covariance[a][b] = 0.5 * (after[a][b] + after[b][a]);
    }
  }
}

DRIFTWALK_LANES_END
