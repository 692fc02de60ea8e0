// Pairs of independent standard normal numbers from two random words (Box-Muller).
//
// The uniform that goes under the logarithm has 24 bits, so |normal| <= 5.77; the tail beyond has
// probability 8e-9.
#pragma once

#include "driftwalk/math/elementary.hpp"

DRIFTWALK_LANES_BEGIN

template <int N>
inline void normal_pair(UIntPack<N> word0, UIntPack<N> word1, FloatPack<N>& first,
                        FloatPack<N>& second) {
  using Real = FloatPack<N>;
  const Real uniform = (to_real(Real(), as_signed(word0 >> 8)) + 1.0f) * 0x1p-24f;
  const Real radius = sqrt(log(uniform) * -2.0f);
  // The angle in quarter turns: quadrant in the two top bits, the rest centred on zero.
  const IntPack<N> quadrant = as_signed(word1 >> 30);
  const Real rest = to_real(Real(), as_signed((word1 >> 8) & 0x3fffffu)) * 0x1p-22f - 0.5f;
  Real sine, cosine;
  sincos_reduced(rest * 1.57079633f, sine, cosine);
  rotate_quadrant(quadrant, sine, cosine);
  first = radius * cosine;
  second = radius * sine;
}

// In double precision; words are 32 bits, whatever is above them.
template <class Real>
  requires std::is_same_v<typename Numbers<Real>::Scalar, double>
DRIFTWALK_HD inline void normal_pair(typename Numbers<Real>::UInt word0,
                                     typename Numbers<Real>::UInt word1, Real& first,
                                     Real& second) {
  const Real uniform = (to_real(first, as_signed((word0 >> 8) & 0xffffffu)) + 1.0) * 0x1p-24;
  const Real radius = sqrt(-2.0 * log(uniform));
  const Real quarter = to_real(first, as_signed((word1 >> 30) & 3u)) +
                       to_real(first, as_signed((word1 >> 8) & 0x3fffffu)) * 0x1p-22 - 0.5;
  Real sine, cosine;
  sincos(quarter * (pi_value / 2), sine, cosine);
  first = radius * cosine;
  second = radius * sine;
}

DRIFTWALK_LANES_END
