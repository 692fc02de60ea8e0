// The angle of a vector, with the same bits on every processor.
//
// The C library chooses a variant with or without fused multiply-add by processor, so its atan2 may
// differ in the last bit from one machine to the next. This one uses only operations that IEEE 754
// defines exactly; it stays within 3 ulp of the exact value.
#pragma once

#include "driftwalk/config.hpp"

DRIFTWALK_LANES_BEGIN

// atan z for |z| <= tan(pi / 8): z + z^3 P(z^2), P the minimax polynomial of degree 10 (Remez,
// relative error 1.3e-18).
DRIFTWALK_HD inline double atan_reduced(double z) {
  const double s = z * z;
  double p = -0x1.255b067ee4fd0p-6;
  p = p * s + 0x1.37ce04b566584p-5;
  p = p * s - 0x1.9ccf73989be50p-5;
  p = p * s + 0x1.df0e7d82491b7p-5;
  p = p * s - 0x1.10eba8971cf8bp-4;
  p = p * s + 0x1.3b11179097bc2p-4;
  p = p * s - 0x1.745cf8c32fc30p-4;
  p = p * s + 0x1.c71c70e50bcf7p-4;
  p = p * s - 0x1.24924922aa47bp-3;
  p = p * s + 0x1.99999999957ccp-3;
  p = p * s - 0x1.555555555553dp-2;
  return z + z * (s * p);
}

// Angle of the vector (x, y) in [-pi, pi], y first as in the C library; x and y finite and
// |x| + |y| in range. Signed zeros count as in IEEE 754: atan2(-0.0, -1.0) = -pi.
DRIFTWALK_HD inline double atan2(double y, double x) {
  constexpr double tan_eighth = 0x1.a827999fcef32p-2;
  constexpr double quarter = 0x1.921fb54442d18p-1; // pi / 4 and what it lacks
  constexpr double quarter_low = 0x1.1a62633145c07p-55;
  const double ax = __builtin_fabs(x);
  const double ay = __builtin_fabs(y);
  const double large = ax > ay ? ax : ay;
  const double small = ax > ay ? ay : ax;
  // Beyond pi / 8 the angle is taken from the diagonal.
  const bool diagonal = small > tan_eighth * large;
  const double top = diagonal ? small - large : small;
  const double bottom = diagonal ? small + large : large;
  const double r = atan_reduced(bottom > 0.0 ? top / bottom : 0.0);
  const double acute = diagonal ? (r + quarter_low) + quarter : r;
  // The nearest axis is 0, pi / 2 or pi; the acute angle is added to it or taken from it.
  const bool steep = ay > ax;
  const bool left = __builtin_copysign(1.0, x) < 0.0;
  const double axis = steep ? 2.0 : (left ? 4.0 : 0.0);
  const double signed_acute = steep != left ? -acute : acute;
  const double angle = (axis * quarter + signed_acute) + axis * quarter_low;
  return __builtin_copysign(angle, y);
}

// The signed angle between two vectors from their cross and dot products, in (-pi, pi].
DRIFTWALK_HD inline double turning_angle(double cross, double dot) {
  constexpr double pi = 0x1.921fb54442d18p+1;
  const double angle = atan2(cross, dot);
  return angle <= -pi ? pi : angle + 0.0; // + 0.0: no negative zero
}

DRIFTWALK_LANES_END
