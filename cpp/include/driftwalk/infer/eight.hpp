// Eight doubles at once, the strips of one side: the same operations in the same order on every
// instruction set, so the same bits.
#pragma once

#include "driftwalk/math/pack.hpp"

DRIFTWALK_LANES_BEGIN

using Four = VectorOf<double, 4>::type;
using Eight = VectorOf<double, 8>::type;
using EightWords = VectorOf<std::int64_t, 8>::type;
using EightIndices = VectorOf<Int32, 8>::type;

inline Eight eight(double value) {
  return Eight{} + value;
}
inline Eight load_eight(const double* from) {
  Eight value;
  __builtin_memcpy(&value, from, sizeof value);
  return value;
}
inline Four load_four(const double* from) {
  Four value;
  __builtin_memcpy(&value, from, sizeof value);
  return value;
}
template <class Vector>
inline void store(double* to, Vector value) {
  __builtin_memcpy(to, &value, sizeof value);
}

// A bound in place of a NaN: the bound comes second, as in pack.hpp.
inline Eight at_least(Eight value, Eight bound) {
  return value > bound ? value : bound;
}
inline Eight at_most(Eight value, Eight bound) {
  return value < bound ? value : bound;
}

struct TwoFours {
  Four low, high;
};
inline Four fold(Eight value) {
  TwoFours halves;
  __builtin_memcpy(&halves, &value, sizeof value);
  return halves.low + halves.high;
}
inline double sum(Eight value) {
  const Four four = fold(value);
  return (four[0] + four[2]) + (four[1] + four[3]);
}

inline bool any(EightWords mask) {
#if defined(DRIFTWALK_USE_X86) && defined(__AVX512DQ__)
  return _mm512_movepi64_mask((__m512i)mask) != 0;
#else
  std::int64_t all = 0;
  for (int lane = 0; lane < 8; ++lane) {
    all |= mask[lane];
  }
  return all != 0;
#endif
}

inline Eight square_root(Eight value) {
#if defined(DRIFTWALK_USE_X86) && defined(__AVX512F__)
  return (Eight)_mm512_sqrt_pd((__m512d)value);
#else
  Eight root;
  for (int lane = 0; lane < 8; ++lane) {
    root[lane] = __builtin_sqrt(value[lane]);
  }
  return root;
#endif
}

DRIFTWALK_LANES_END
