// Logarithm, exponential, sine and cosine of our own for the float packs: the same operations on
// every instruction set give the same bits, which no vendor's library promises.
//
// Sources: Cody-Waite reduction by pi/2 and minimax polynomials of the usual degree; errors are
// measured in cpp/tests/test_math.cpp (log and exp below 1 ulp; sine and cosine below 2 ulp
// on [-8, 8], the worst of every seventh float there 1.65).
#pragma once

#include "driftwalk/math/double_pack.hpp"

DRIFTWALK_LANES_BEGIN

inline constexpr double pi_value = 3.14159265358979323846;

// Sine and cosine of r in [-pi/4, pi/4].
template <class Real>
inline void sincos_reduced(Real r, Real& sine, Real& cosine) {
  const Real z = r * r;
  const Real s =
      ((Real(-1.9515295891e-4f) * z + 8.3321608736e-3f) * z - 1.6666654611e-1f) * z * r + r;
  const Real c =
      ((Real(2.443315711809948e-5f) * z - 1.388731625493765e-3f) * z + 4.166664568298827e-2f) * z *
          z -
      0.5f * z + 1.0f;
  sine = s;
  cosine = c;
}

// Turn (sine, cosine) of the remainder by `quadrant` quarter turns.
template <int N>
inline void rotate_quadrant(IntPack<N> quadrant, FloatPack<N>& sine, FloatPack<N>& cosine) {
  const Mask<N> swapped = (quadrant & 1) != 0;
  const FloatPack<N> s = select(swapped, cosine, sine);
  const FloatPack<N> c = select(swapped, sine, cosine);
  typedef typename IntPack<N>::Vector Bits;
  typedef typename FloatPack<N>::Vector Values;
  const Bits sine_sign = (quadrant.v & 2) << 30;
  const Bits cosine_sign = ((quadrant.v + 1) & 2) << 30;
  sine = FloatPack<N>((Values)((Bits)s.v ^ sine_sign));
  cosine = FloatPack<N>((Values)((Bits)c.v ^ cosine_sign));
}

// Sine and cosine of x [rad], |x| <= 8.
template <int N>
inline void sincos(FloatPack<N> x, FloatPack<N>& sine, FloatPack<N>& cosine) {
  using Real = FloatPack<N>;
  const IntPack<N> quadrant = nearest(x * 0.636619772f);
  const Real k = to_real(x, quadrant);
  // pi/2 in three parts, the first two exact in few bits, so that k * part is exact.
  const Real r = ((x - k * 1.5703125f) - k * 4.8351287841796875e-4f) -
                 k * 3.13855707645416259765625e-7f - k * 6.0771005e-11f;
  sincos_reduced(r, sine, cosine);
  rotate_quadrant(quadrant, sine, cosine);
}

// Natural logarithm of a positive x (no zeros, no denormals, no infinities).
template <int N>
inline FloatPack<N> log(FloatPack<N> x) {
  using Real = FloatPack<N>;
  typedef typename IntPack<N>::Vector Bits;
  typedef typename FloatPack<N>::Vector Values;
  const Bits bits = (Bits)x.v;
  // Mantissa in [sqrt(1/2), sqrt(2)), and the exponent that goes with it.
  const Bits shifted = bits - 0x3f3504f3;
  const IntPack<N> exponent = IntPack<N>(shifted >> 23);
  const Real m = Real((Values)((shifted & 0x007fffff) + 0x3f3504f3));
  const Real f = m - 1.0f;
  const Real z = f * f;
  Real p = Real(7.0376836292e-2f);
  p = p * f - 1.1514610310e-1f;
  p = p * f + 1.1676998740e-1f;
  p = p * f - 1.2420140846e-1f;
  p = p * f + 1.4249322787e-1f;
  p = p * f - 1.6668057665e-1f;
  p = p * f + 2.0000714765e-1f;
  p = p * f - 2.4999993993e-1f;
  p = p * f + 3.3333331174e-1f;
  const Real e = to_real(x, exponent);
  return ((p * f * z + e * -2.12194440e-4f) - 0.5f * z) + f + e * 0.693359375f;
}

// Exponential of x, -87 <= x <= 88.
template <int N>
inline FloatPack<N> exp(FloatPack<N> x) {
  using Real = FloatPack<N>;
  typedef typename IntPack<N>::Vector Bits;
  typedef typename FloatPack<N>::Vector Values;
  const IntPack<N> power = nearest(x * 1.44269504f);
  const Real k = to_real(x, power);
  const Real r = (x - k * 0.693359375f) - k * -2.12194440e-4f;
  Real p = Real(1.9875691500e-4f);
  p = p * r + 1.3981999507e-3f;
  p = p * r + 8.3334519073e-3f;
  p = p * r + 4.1665795894e-2f;
  p = p * r + 1.6666665459e-1f;
  p = p * r + 5.0000001201e-1f;
  const Bits scale = (power.v + 127) << 23;
  return (p * (r * r) + r + 1.0f) * Real((Values)scale);
}

template <class Real, class T>
inline Real clamp_to(Real value, T low, T high) {
  return min(max(value, Real(low)), Real(high));
}

// An angle that sincos accepts, whatever came in: a runaway world stays harmless.
template <class Real>
inline Real bounded_angle(Real angle) {
  using T = typename Numbers<Real>::Scalar;
  return clamp_to(angle, T(-8), T(8));
}

// Wrap an angle [rad] into [-pi, pi]; the input lies within [-2 pi, 2 pi].
template <class Real>
inline Real wrap_angle(Real angle) {
  using T = typename Numbers<Real>::Scalar;
  const Real turn = Real(static_cast<T>(2 * pi_value));
  const Real half = Real(static_cast<T>(pi_value));
  angle = select(angle > half, angle - turn, angle);
  return select(angle < -half, angle + turn, angle);
}

DRIFTWALK_LANES_END
