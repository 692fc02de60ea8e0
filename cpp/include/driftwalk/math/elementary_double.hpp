// Logarithm, exponential, sine and cosine in double precision: no fused operation and no function
// of the system, so the same bits on every system, in a browser too. Where no kernel comes, very
// large numbers and none, the system answers. Errors are measured in cpp/tests/test_math.cpp: below
// 1 ulp.
//
// Algorithms and coefficients are those of FreeBSD's msun, from fdlibm, whose notice is:
//
//     Copyright (C) 1993 by Sun Microsystems, Inc. All rights reserved.
//     Developed at SunPro, a Sun Microsystems, Inc. business. Permission to use, copy, modify, and
//     distribute this software is freely granted, provided that this notice is preserved.
#pragma once

#include "driftwalk/config.hpp"

#include <cstdint>

DRIFTWALK_LANES_BEGIN

// Sine and cosine of r + tail, r in [-pi/4, pi/4]. `Real` is a double or a pack of them.
template <class Real>
DRIFTWALK_HD inline Real sine_reduced(Real r, Real tail) {
  const Real z = r * r, v = z * r;
  const Real p = 8.33333333332248946124e-03 +
                 z * (-1.98412698298579493134e-04 + z * 2.75573137070700676789e-06) +
                 z * (z * z) * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10);
  return r - ((z * (0.5 * tail - v * p) - tail) - v * -1.66666666666666324348e-01);
}
template <class Real>
DRIFTWALK_HD inline Real cosine_reduced(Real r, Real tail) {
  const Real z = r * r, w = z * z, half = 0.5 * z, whole = 1.0 - half;
  const Real p = z * (4.16666666666666019037e-02 +
                      z * (-1.38888888888741095749e-03 + z * 2.48015872894767294178e-05)) +
                 w * w *
                     (-2.75573143513906633035e-07 +
                      z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11));
  return whole + (((1.0 - whole) - half) + (z * p - r * tail));
}

// The same of x, `k` the nearest number of quarter turns: pi/2 is in parts of 33 bits, so that k
// times a part is exact, and what is left.
template <class Real>
DRIFTWALK_HD inline void sincos_past(Real x, Real k, Real& sine, Real& cosine) {
  const Real first = x - k * 1.57079632673412561417e+00, second = k * 6.07710050630396597660e-11;
  const Real near = first - second;
  const Real rest = k * 2.02226624879595063154e-21 - ((first - near) - second);
  const Real r = near - rest, tail = (near - r) - rest;
  sine = sine_reduced(r, tail);
  cosine = cosine_reduced(r, tail);
}

// Logarithm of (1 + f) 2^e, 1 + f in [sqrt(1/2), sqrt(2)).
template <class Real>
DRIFTWALK_HD inline Real log_reduced(Real f, Real e) {
  const Real s = f / (2.0 + f), z = s * s, w = z * z, half = 0.5 * f * f;
  const Real even = w * (3.999999999940941908e-01 +
                         w * (2.222219843214978396e-01 + w * 1.531383769920937332e-01));
  const Real odd = z * (6.666666666666735130e-01 +
                        w * (2.857142874366239149e-01 +
                             w * (1.818357216161805012e-01 + w * 1.479819860511658591e-01)));
  return s * (half + (odd + even)) + e * 1.90821492927058770002e-10 - half + f +
         e * 6.93147180369123816490e-01;
}

// Exponential of x over 2^power, the nearest power.
template <class Real>
DRIFTWALK_HD inline Real exp_reduced(Real x, Real power) {
  const Real high = x - power * 6.93147180369123816490e-01;
  const Real low = power * 1.90821492927058770002e-10;
  const Real r = high - low, z = r * r;
  const Real c =
      r - z * (1.66666666666666019037e-01 +
               z * (-2.77777777770155933842e-03 +
                    z * (6.61375632143793436117e-05 +
                         z * (-1.65339022054652515390e-06 + z * 4.13813679705723846039e-08))));
  return 1.0 + (r * c / (2.0 - c) - low + high);
}

DRIFTWALK_HD inline void sincos(double x, double& sine, double& cosine) {
  if (!(__builtin_fabs(x) < 1e5)) {
    sine = __builtin_sin(x);
    cosine = __builtin_cos(x);
    return;
  }
  const double scaled = x * 6.36619772367581382433e-01;
  const auto quadrant = static_cast<std::int32_t>(scaled + (scaled < 0 ? -0.5 : 0.5));
  double s, c;
  sincos_past(x, static_cast<double>(quadrant), s, c);
  const double turned_sine = (quadrant & 1) != 0 ? c : s,
               turned_cosine = (quadrant & 1) != 0 ? s : c;
  sine = (quadrant & 2) != 0 ? -turned_sine : turned_sine;
  cosine = ((quadrant + 1) & 2) != 0 ? -turned_cosine : turned_cosine;
}

DRIFTWALK_HD inline double log(double x) {
  if (!(x >= 0x1p-1000 && x <= 0x1p1000)) {
    return __builtin_log(x);
  }
  // Mantissa in [sqrt(1/2), sqrt(2)), and the exponent that goes with it.
  std::uint64_t bits;
  __builtin_memcpy(&bits, &x, sizeof bits);
  const std::uint64_t root = 0x3fe6a09e00000000, shifted = bits - root;
  const double e = static_cast<double>(static_cast<std::int64_t>(shifted) >> 52);
  bits = (shifted & 0x000fffffffffffff) + root;
  double m;
  __builtin_memcpy(&m, &bits, sizeof m);
  return log_reduced(m - 1.0, e);
}

DRIFTWALK_HD inline double exp(double x) {
  if (!(x > -700 && x < 700)) {
    return __builtin_exp(x);
  }
  const double scaled = x * 1.44269504088896338700e+00;
  const auto power = static_cast<std::int32_t>(scaled + (scaled < 0 ? -0.5 : 0.5));
  const std::uint64_t bits = static_cast<std::uint64_t>(1023 + power) << 52;
  double scale;
  __builtin_memcpy(&scale, &bits, sizeof scale);
  return exp_reduced(x, static_cast<double>(power)) * scale;
}

DRIFTWALK_LANES_END
