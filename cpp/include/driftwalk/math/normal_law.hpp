// Density and distribution function of the standard normal law for eight numbers.
//
// The upper tail is the density times Mills' ratio, a polynomial of degree 16 in the place of |z|
// on the Moebius map of [0, 8] to [-1, 1] (Chebyshev fit; relative error below 2e-14, measured in
// cpp/tests/test_infer.cpp).
#pragma once

#include "driftwalk/math/doubles.hpp"

DRIFTWALK_LANES_BEGIN

// Beyond it the tail, below 1e-15, counts as nothing.
inline constexpr double normal_reach = 8;

// exp(x) for -700 <= x <= 700.
inline Eight exponential(Eight x) {
  // Adding 1.5 * 2^52 rounds to a whole number and leaves it in the low bits.
  constexpr double to_whole = 6755399441055744.0;
  const Eight shifted = x * 1.4426950408889634 + to_whole;
  const Eight whole = shifted - to_whole;
  const Eight r = (x - whole * 6.93147180369123816490e-01) - whole * 1.90821492927058770002e-10;
  const Eight z = r * r;
  const Eight even =
      1.0 +
      z * (1.0 / 2 +
           z * (1.0 / 24 +
                z * (1.0 / 720 + z * (1.0 / 40320 + z * (1.0 / 3628800 + z * (1.0 / 479001600))))));
  const Eight odd =
      1.0 + z * (1.0 / 6 +
                 z * (1.0 / 120 + z * (1.0 / 5040 + z * (1.0 / 362880 + z * (1.0 / 39916800)))));
  const Eight power = Eight::each(
      [&](int k) { return (Eight::Vector)(((Eight::Words)shifted.part[k] + 1023) << 52); });
  return (even + r * odd) * power;
}

// (1 - Phi(x)) / phi(x) for 0 <= x <= 8.
inline Eight mills_ratio(Eight x) {
  const Eight t = 16.25 / (x + 5.0) - 2.25;
  const Eight z = t * t;
  const Eight even = 3.88887351187019115e-01 +
                     z * (2.54948691215412582e-01 +
                          z * (4.23198056226671143e-02 +
                               z * (2.09697021742171700e-03 +
                                    z * (-2.98346605883331996e-05 +
                                         z * (5.37283434799794483e-08 +
                                              z * (1.35863875156986997e-08 +
                                                   z * (-6.29316105602997372e-10 +
                                                        z * 1.93706375382554648e-11)))))));
  const Eight odd =
      4.35920128707135923e-01 +
      z * (1.17564574134566460e-01 +
           z * (1.14502802361827662e-02 +
                z * (1.64845403595983319e-04 +
                     z * (-9.05314920714822660e-06 +
                          z * (3.23511418792417452e-07 +
                               z * (-1.22624249851858626e-08 + z * 4.47516543463937479e-10))))));
  return even + t * odd;
}

struct NormalLaw {
  Eight density;     // phi(z)
  Eight probability; // Phi(z)
};

inline NormalLaw normal_law(Eight z) {
  const Eight::Mask above = z > normal_reach, below = z < -normal_reach;
  const Eight::Mask between = !(above | below);
  NormalLaw law{0.0, select(above, Eight(1), Eight(0))};
  if (any(between)) {
    const Eight::Mask negative = z < 0;
    const Eight size = at_most(select(negative, -z, z), normal_reach);
    const Eight density = 0.3989422804014327 * exponential(-0.5 * (size * size));
    const Eight tail = density * mills_ratio(size);
    law.density = select(between, density, Eight(0));
    law.probability = select(between, select(negative, tail, 1 - tail), law.probability);
  }
  return law;
}

DRIFTWALK_LANES_END
