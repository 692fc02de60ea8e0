// The stochastic force as a field in space: blocks that are near each other feel nearly the same.
//
// On a lattice of spacing h = L/1.1 (L/1.35 without divergence) every node c has a normal number
// xi_c, at an address made of the force interval and the node. A block at x feels
//     n(x) = sum over c of w(x - x_c) xi_c / norm,   w(r) = exp(-r^2/L^2)
// over the 5 x 5 (7 x 7) nodes around it, norm^2 the sum of w^2 there: one block feels a standard
// normal number, two feel numbers with the correlation exp(-r^2/2L^2) to 0.5 %. The cost of a block
// does not depend on how many there are. Divergence-free, xi is a stream function psi, and the
// force (d psi/dy, -d psi/dx) with the same norm: along x the correlation is (1 - y^2/L^2)
// exp(-r^2/2L^2).
#pragma once

#include "driftwalk/random/normal.hpp"
#include "driftwalk/random/philox.hpp"

#include <type_traits>

DRIFTWALK_LANES_BEGIN

template <class T, int N>
inline Pack<UnsignedAs<T>, N> as_unsigned(Pack<T, N> a) {
  return (typename Pack<UnsignedAs<T>, N>::Vector)a.v;
}
inline UInt32 as_unsigned(Int32 a) {
  return static_cast<UInt32>(a);
}

// A lattice: nodes per length L, and on each side of the nearest one. The derivatives of a stream
// function need a finer one for the same error.
struct FreeStirring {
  static constexpr double nodes_per_length = 1.1;
  static constexpr int reach = 2, row = 5;
};
struct IncompressibleStirring {
  static constexpr double nodes_per_length = 1.35;
  static constexpr int reach = 3, row = 7;
};

// The nodes around a place along one axis: the first one's number, and for each its weight and, as
// a stream function wants it, the slope of the weight.
template <class Real, class Lattice>
struct StirringAxis {
  typename Numbers<Real>::Int first;
  Real weight[Lattice::row], slope[Lattice::row];
  Real square{typename Numbers<Real>::Scalar(0)}; // sum of the squared weights
  Real slope_square{typename Numbers<Real>::Scalar(0)};

  StirringAxis(Real place, typename Numbers<Real>::Scalar per_spacing) {
    using T = typename Numbers<Real>::Scalar;
    constexpr T per_square =
        static_cast<T>(1 / (Lattice::nodes_per_length * Lattice::nodes_per_length));
    const Real at = place * per_spacing;
    const auto nearest_node = truncate(at + copy_sign(Real(T(0.5)), at));
    const Real offset = at - to_real(at, nearest_node);
    first = nearest_node - typename Numbers<Real>::Int(Lattice::reach);
    for (int k = 0; k < Lattice::row; ++k) {
      const Real away = offset - Real(static_cast<T>(k - Lattice::reach));
      weight[k] = exp(away * away * (-per_square));
      slope[k] = away * weight[k];
      square = square + weight[k] * weight[k];
      slope_square = slope_square + slope[k] * slope[k];
    }
  }
};

// Four normal numbers at a place: along x and y in one force interval, and in the next.
template <class Lattice, class Real>
inline void draw_stirring(const Philox<typename Numbers<Real>::UInt>& stream,
                          typename Numbers<Real>::UInt draw, typename Numbers<Real>::Scalar length,
                          Real x, Real y, Real* normals) {
  constexpr bool incompressible = std::is_same_v<Lattice, IncompressibleStirring>;
  using T = typename Numbers<Real>::Scalar;
  using UInt = typename Numbers<Real>::UInt;
  using Int = typename Numbers<Real>::Int;
  const T per_spacing = static_cast<T>(Lattice::nodes_per_length) / length;
  const StirringAxis<Real, Lattice> across(x, per_spacing), up(y, per_spacing);
  const Real zero{T(0)}, one{T(1)};
  Real sum[4] = {zero, zero, zero, zero};
  for (int j = 0; j < Lattice::row; ++j) {
    const UInt row = as_unsigned(up.first + Int(j)) << 16;
    for (int i = 0; i < Lattice::row; ++i) {
      const UInt node = row | (as_unsigned(across.first + Int(i)) & UInt(0xffffu));
      UInt words[4];
      stream(draw, node, UInt(static_cast<UInt32>(0)), UInt(static_cast<UInt32>(Purpose::stirring)),
             words);
      Real at[4];
      normal_pair(words[0], words[1], at[0], at[1]);
      if (incompressible) {
        const Real along_x = across.weight[i] * up.slope[j];
        const Real along_y = across.slope[i] * up.weight[j];
        sum[0] = sum[0] + along_x * at[0];
        sum[1] = sum[1] - along_y * at[0];
        sum[2] = sum[2] + along_x * at[1];
        sum[3] = sum[3] - along_y * at[1];
        continue;
      }
      normal_pair(words[2], words[3], at[2], at[3]);
      const Real weight = across.weight[i] * up.weight[j];
      for (int k = 0; k < 4; ++k) {
        sum[k] = sum[k] + weight * at[k];
      }
    }
  }
  const Real plain = across.square * up.square;
  const Real norm_x = one / sqrt(incompressible ? across.square * up.slope_square : plain);
  const Real norm_y = one / sqrt(incompressible ? across.slope_square * up.square : plain);
  for (int k = 0; k < 4; ++k) {
    normals[k] = sum[k] * ((k & 1) == 0 ? norm_x : norm_y);
  }
}

DRIFTWALK_LANES_END
