// The stochastic forces on a few blocks, correlated by a Cholesky factor: for up to eight blocks it
// is exact, and cheaper than the field of random/stirring.hpp, which is that of many.
//
// Two blocks at a distance r = (x, y) feel forces with the correlation rho = exp(-r^2/2L^2) along
// each axis; without divergence (1 - y^2/L^2) rho along x, (1 - x^2/L^2) rho along y, and x y/L^2
// rho between the two. Where L goes to 0 the forces are those without, bit for bit.
#pragma once

#include "driftwalk/assembly/member.hpp"

DRIFTWALK_LANES_BEGIN

inline constexpr int most_blocks_correlated = 8;

// The lower factor of a correlation matrix, in place. Blocks that touch are all but one when the
// length is large: the floor keeps the root real.
template <class Real>
inline void factorise(Real (*matrix)[2 * most_blocks_correlated], int size) {
  using T = typename Numbers<Real>::Scalar;
  for (int i = 0; i < size; ++i) {
    for (int j = 0; j <= i; ++j) {
      Real left = matrix[i][j];
      for (int k = 0; k < j; ++k) {
        left = left - matrix[i][k] * matrix[j][k];
      }
      matrix[i][j] = i == j ? sqrt(max(left, Real(static_cast<T>(1e-6)))) : left / matrix[j][j];
    }
  }
}

// Mixes the normal numbers of the blocks, four each: along x and y in one force interval, and in
// the next.
template <class Real>
inline void correlate(typename Numbers<Real>::Scalar length, bool incompressible, int blocks,
                      Member<Real>* members) {
  using T = typename Numbers<Real>::Scalar;
  const T per_square = T(1) / (length * length);
  const int parts = incompressible ? 2 : 1, size = parts * blocks;
  Real matrix[2 * most_blocks_correlated][2 * most_blocks_correlated];
  for (int b = 0; b < blocks; ++b) {
    for (int c = 0; c <= b; ++c) {
      const Real x = members[b].x - members[c].x, y = members[b].y - members[c].y;
      const Real rho = exp((x * x + y * y) * (T(-0.5) * per_square));
      if (!incompressible) {
        matrix[b][c] = rho;
        continue;
      }
      const Real one{T(1)};
      matrix[2 * b][2 * c] = rho * (one - y * y * per_square);
      matrix[2 * b + 1][2 * c + 1] = rho * (one - x * x * per_square);
      matrix[2 * b + 1][2 * c] = rho * (x * y * per_square);
      if (c < b) {
        matrix[2 * b][2 * c + 1] = matrix[2 * b + 1][2 * c];
      }
    }
  }
  factorise<Real>(matrix, size);
  // From the last row up, as a row takes the numbers of those before it.
  for (int i = size - 1; i >= 0; --i) {
    Real* const own = members[i / parts].normals;
    // Without coupling of the axes a row stands for both; with it for one.
    for (int n = incompressible ? i % 2 : 0; n < 4; n += parts) {
      Real mixed = matrix[i][i] * own[n];
      for (int k = 0; k < i; ++k) {
        const int from = incompressible ? (n & 2) + k % 2 : n;
        mixed = mixed + matrix[i][k] * members[k / parts].normals[from];
      }
      own[n] = mixed;
    }
  }
}

DRIFTWALK_LANES_END
