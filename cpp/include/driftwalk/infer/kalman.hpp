// Mean and covariance of D coordinates and their velocities through a drift, a kick and a sample.
#pragma once

#include "driftwalk/config.hpp"
#include "driftwalk/infer/problem.hpp"

DRIFTWALK_LANES_BEGIN

template <int N>
using Square = double[N][N];

// Coordinates move by `dt` times their velocities.
template <int D, int F>
inline void drift_mean(FilterState<D, F>& state, double dt) {
  for (int a = 0; a < D; ++a) {
    state.mean[a] += dt * state.mean[a + D];
  }
}
template <int D, int F>
inline void drift_covariance(FilterState<D, F>& state, double dt) {
  Square<2 * D + F>& P = state.covariance;
  for (int a = 0; a < D; ++a) {
    for (int b = 0; b < 2 * D + F; ++b) {
      P[a][b] += dt * P[a + D][b];
    }
  }
  for (int a = 0; a < 2 * D + F; ++a) {
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
  double by_log_drag[D]; // the part of it that the drag has: its derivative by ln C_d
  Square<D> by_position; // d(v')/d(coordinates)
  Square<D> by_velocity; // d(v')/d(v)
  // What a force that remembers adds: to the velocity W times it by `force_time`, to the
  // coordinates, beyond what the drift does, W times it by `force_lag`.
  double force_time = 0; // [s]
  double force_lag = 0;  // [s^2]
  double force_kept = 1; // what the step leaves of it
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
      kick.by_log_drag[a] += w * drag.drag[c];
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

// What a remembered force (x and y of it) does to velocities and coordinates in a kick, before it
// fades: adds to `velocities` and `coordinates`.
template <int D, class Real>
inline void push_linear(const Kick<D>& kick, const Real (&force)[2], Real (&coordinates)[D],
                        Real (&velocities)[D]) {
  for (int a = 0; a < D; ++a) {
    const Real damped = kick.inverse[a][0] * force[0] + kick.inverse[a][1] * force[1];
    velocities[a] = velocities[a] + kick.force_time * damped;
    coordinates[a] = coordinates[a] + kick.force_lag * damped;
  }
}

// One column or row of the covariance, number a of it at `at(a)`.
template <int D, int F, class At>
inline void kick_line(const Kick<D>& kick, const At& at) {
  double coordinates[D], velocities[D], after[D];
  for (int a = 0; a < D; ++a) {
    coordinates[a] = at(a);
    velocities[a] = at(a + D);
  }
  kick_linear<D, double>(kick, coordinates, velocities, after);
  if constexpr (F == 2) {
    const double force[2] = {at(2 * D), at(2 * D + 1)};
    push_linear<D, double>(kick, force, coordinates, after);
    for (int a = 0; a < D; ++a) {
      at(a) = coordinates[a];
    }
    at(2 * D) *= kick.force_kept;
    at(2 * D + 1) *= kick.force_kept;
  }
  for (int a = 0; a < D; ++a) {
    at(a + D) = after[a];
  }
}

template <int D, int F>
inline void kick_covariance(FilterState<D, F>& state, const Kick<D>& kick) {
  Square<2 * D + F>& P = state.covariance;
  for (int b = 0; b < 2 * D + F; ++b) {
    kick_line<D, F>(kick, [&](int a) -> double& { return P[a][b]; });
  }
  for (int b = 0; b < 2 * D + F; ++b) {
    kick_line<D, F>(kick, [&](int a) -> double& { return P[b][a]; });
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
template <int D, int F>
inline void add_noise(FilterState<D, F>& state, const Square<D>& W, const Square<D>& intensity,
                      double h) {
  Square<2 * D + F>& P = state.covariance;
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

// The covariances, over its intensity, of what a force of memory T that starts from zero has done
// after a step h: to the coordinate x, the velocity v and itself, f.
struct MemoryNoise {
  double xx, xv, vv, xf, vf, ff;
};

inline MemoryNoise memory_noise(double h, double T) {
  const double e = __builtin_exp(-h / T), gone = 1 - e, square_gone = 1 - e * e;
  const double mean = h - T * gone;
  return {h * h * h / 3 - T * h * h + T * T * h + 2 * T * T * (T * gone - h * e) -
              2 * T * T * T * gone + T * T * T / 2 * square_gone,
          mean * mean / 2,
          h - 2 * T * gone + T / 2 * square_gone,
          T * square_gone / 2 - h * e,
          gone * gone / 2,
          square_gone / (2 * T)};
}

// The force that remembers, of white intensity q, over a step h.
template <int D>
inline void add_memory_noise(FilterState<D, 2>& state, const Square<D>& W, double q, double h,
                             double memory) {
  const MemoryNoise noise = memory_noise(h, memory);
  Square<2 * D + 2>& P = state.covariance;
  for (int a = 0; a < D; ++a) {
    for (int b = 0; b < D; ++b) {
      const double damped = q * (W[a][0] * W[b][0] + W[a][1] * W[b][1]);
      P[a][b] += noise.xx * damped;
      P[a][b + D] += noise.xv * damped;
      P[a + D][b] += noise.xv * damped;
      P[a + D][b + D] += noise.vv * damped;
    }
    for (int f = 0; f < 2; ++f) {
      const double x = q * noise.xf * W[a][f], v = q * noise.vf * W[a][f];
      P[a][2 * D + f] += x;
      P[2 * D + f][a] += x;
      P[a + D][2 * D + f] += v;
      P[2 * D + f][a + D] += v;
    }
  }
  for (int f = 2 * D; f < 2 * D + 2; ++f) {
    P[f][f] += q * noise.ff;
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

// The error of its time stamp moves a sample along the velocity.
template <int D, int F>
inline Innovation<D> innovation_of(const FilterState<D, F>& state, const double (&sample)[D],
                                   const double (&variance)[D], double time_variance) {
  Innovation<D> out{};
  for (int a = 0; a < D; ++a) {
    out.e[a] = sample[a] - state.mean[a];
    for (int b = 0; b < D; ++b) {
      out.S[a][b] = state.covariance[a][b] + (a == b ? variance[a] : 0) +
                    time_variance * state.mean[a + D] * state.mean[b + D];
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
template <int D, int F>
struct Gain {
  double by[2 * D + F][D];
};

template <int D, int F>
inline Gain<D, F> gain_of(const FilterState<D, F>& state, const Innovation<D>& e) {
  const Square<2 * D + F>& P = state.covariance;
  Gain<D, F> gain;
  for (int row = 0; row < 2 * D + F; ++row) {
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

template <int D, int F>
inline void update(FilterState<D, F>& state, const Innovation<D>& e, const Gain<D, F>& gain) {
  Square<2 * D + F> after;
  for (int a = 0; a < 2 * D + F; ++a) {
    for (int b = 0; b < 2 * D + F; ++b) {
      after[a][b] = state.covariance[a][b];
      for (int c = 0; c < D; ++c) {
        after[a][b] -= gain.by[a][c] * state.covariance[c][b];
      }
    }
    for (int c = 0; c < D; ++c) {
      state.mean[a] += gain.by[a][c] * e.e[c];
    }
  }
  for (int a = 0; a < 2 * D + F; ++a) {
    for (int b = 0; b < 2 * D + F; ++b) {
      state.covariance[a][b] = 0.5 * (after[a][b] + after[b][a]);
    }
  }
}

DRIFTWALK_LANES_END
