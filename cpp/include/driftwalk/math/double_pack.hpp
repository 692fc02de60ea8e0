// Packs of doubles with the bits of single doubles: every operation is one that IEEE 754 defines,
// in the same order, and what a single number leaves to the system, a lane does too.
#pragma once

#include "driftwalk/math/elementary_double.hpp"
#include "driftwalk/math/pack.hpp"

DRIFTWALK_LANES_BEGIN

template <int N>
using DoublePack = Pack<double, N>;

template <int N>
inline bool any(Mask<N, std::int64_t> mask) {
#if defined(DRIFTWALK_USE_X86)
#if defined(__AVX512DQ__)
  if constexpr (N == 8) {
    return _mm512_movepi64_mask((__m512i)mask.v) != 0;
  }
#endif
#if defined(__AVX__)
  if constexpr (N == 4) {
    return _mm256_movemask_pd((__m256d)mask.v) != 0;
  }
#endif
  if constexpr (N == 2) {
    return _mm_movemask_pd((__m128d)mask.v) != 0;
  }
#endif
  std::int64_t all = 0;
  for (int lane = 0; lane < N; ++lane) {
    all |= mask.v[lane];
  }
  return all != 0;
}

template <int N>
inline DoublePack<N> max(DoublePack<N> a, DoublePack<N> b) {
  return a.v > b.v ? a.v : b.v;
}
template <int N>
inline DoublePack<N> min(DoublePack<N> a, DoublePack<N> b) {
  return a.v < b.v ? a.v : b.v;
}
template <int N>
inline DoublePack<N> sqrt(DoublePack<N> a) {
#if defined(DRIFTWALK_USE_X86)
  using Vector = typename DoublePack<N>::Vector;
#if defined(__AVX512F__)
  if constexpr (N == 8) {
    return DoublePack<N>((Vector)_mm512_sqrt_pd((__m512d)a.v));
  }
#endif
#if defined(__AVX__)
  if constexpr (N == 4) {
    return DoublePack<N>((Vector)_mm256_sqrt_pd((__m256d)a.v));
  }
#endif
  if constexpr (N == 2) {
    return DoublePack<N>((Vector)_mm_sqrt_pd((__m128d)a.v));
  }
#endif
  DoublePack<N> root;
  for (int lane = 0; lane < N; ++lane) {
    root.v[lane] = __builtin_sqrt(a.v[lane]);
  }
  return root;
}
// As of one number: -0 stays.
template <int N>
inline DoublePack<N> abs(DoublePack<N> a) {
  return select(a < 0.0, -a, a);
}
template <int N>
inline DoublePack<N> copy_sign(DoublePack<N> magnitude, DoublePack<N> sign) {
  using Bits = typename VectorOf<std::int64_t, N>::type;
  const Bits mask = Bits{} + std::int64_t(0x7fffffffffffffff);
  return (typename DoublePack<N>::Vector)(((Bits)magnitude.v & mask) | ((Bits)sign.v & ~mask));
}

// Integers of 32 bits, as of one number, and as processors do it without AVX-512.
template <int N>
inline IntPack<N> narrow(DoublePack<N> a) {
  return __builtin_convertvector(a.v, typename IntPack<N>::Vector);
}
template <int N>
inline Pack<std::int64_t, N> widen(IntPack<N> a) {
  return __builtin_convertvector(a.v, typename Pack<std::int64_t, N>::Vector);
}
template <int N>
inline Pack<std::int64_t, N> truncate(DoublePack<N> a) {
  return widen(narrow(a));
}
template <int N>
inline DoublePack<N> to_real(DoublePack<N>, IntPack<N> a) {
#if defined(DRIFTWALK_USE_X86) && defined(__AVX512F__)
  if constexpr (N == 8) {
    return DoublePack<N>((typename DoublePack<N>::Vector)_mm512_cvtepi32_pd((__m256i)a.v));
  }
#endif
  return __builtin_convertvector(a.v, typename DoublePack<N>::Vector);
}
template <int N>
inline DoublePack<N> to_real(DoublePack<N> like, Pack<std::int64_t, N> a) {
  return to_real(like, IntPack<N>(__builtin_convertvector(a.v, typename IntPack<N>::Vector)));
}

// Of the low words of 64-bit lanes; the high words of the products are void.
template <int N>
inline void multiply_wide(UInt32 a, Pack<std::uint64_t, N> b, Pack<std::uint64_t, N>& high,
                          Pack<std::uint64_t, N>& low) {
  low = (b & 0xffffffffu) * a;
#if defined(DRIFTWALK_USE_X86)
  using Vector = typename Pack<std::uint64_t, N>::Vector;
#if defined(__AVX512F__)
  if constexpr (N == 8) {
    low = (Vector)_mm512_mul_epu32(_mm512_set1_epi64(a), (__m512i)b.v);
  }
#endif
#if defined(__AVX2__)
  if constexpr (N == 4) {
    low = (Vector)_mm256_mul_epu32(_mm256_set1_epi64x(a), (__m256i)b.v);
  }
#endif
  if constexpr (N == 2) {
    low = (Vector)_mm_mul_epu32(_mm_set1_epi64x(a), (__m128i)b.v);
  }
#endif
  high = low >> 32;
}

// A function of one number, lane by lane.
template <int N, class Function>
inline DoublePack<N> by_lanes(DoublePack<N> x, const Function& function) {
  for (int lane = 0; lane < N; ++lane) {
    x.v[lane] = function(x.v[lane]);
  }
  return x;
}

template <int N>
inline void sincos(DoublePack<N> x, DoublePack<N>& sine, DoublePack<N>& cosine) {
  using Real = DoublePack<N>;
  if (any(!(abs(x) < 1e5))) {
    for (int lane = 0; lane < N; ++lane) {
      double s, c;
      sincos(double(x.v[lane]), s, c);
      sine.v[lane] = s;
      cosine.v[lane] = c;
    }
    return;
  }
  const Real scaled = x * 6.36619772367581382433e-01;
  const IntPack<N> nearest = narrow(scaled + select(scaled < 0.0, Real(-0.5), Real(0.5)));
  Real s, c;
  sincos_past(x, to_real(x, nearest), s, c);
  const auto quadrant = widen(nearest);
  const auto swapped = (quadrant & 1) != 0;
  const Real turned_sine = select(swapped, c, s), turned_cosine = select(swapped, s, c);
  sine = select((quadrant & 2) != 0, -turned_sine, turned_sine);
  cosine = select(((quadrant + 1) & 2) != 0, -turned_cosine, turned_cosine);
}

template <int N>
inline DoublePack<N> log(DoublePack<N> x) {
  if (any(!((x >= 0x1p-1000) & (x <= 0x1p1000)))) {
    return by_lanes(x, [](double one) { return log(one); });
  }
  using Bits = typename VectorOf<std::int64_t, N>::type;
  using Values = typename DoublePack<N>::Vector;
  const Bits shifted = (Bits)x.v - 0x3fe6a09e00000000;
  const DoublePack<N> e = to_real(x, Pack<std::int64_t, N>(shifted >> 52));
  const Bits mantissa = (shifted & 0x000fffffffffffff) + 0x3fe6a09e00000000;
  return log_reduced(DoublePack<N>((Values)mantissa) - 1.0, e);
}

template <int N>
inline DoublePack<N> exp(DoublePack<N> x) {
  if (any(!((x > -700.0) & (x < 700.0)))) {
    return by_lanes(x, [](double one) { return exp(one); });
  }
  using Values = typename DoublePack<N>::Vector;
  const DoublePack<N> scaled = x * 1.44269504088896338700e+00;
  const auto power =
      truncate(scaled + select(scaled < 0.0, DoublePack<N>(-0.5), DoublePack<N>(0.5)));
  const DoublePack<N> scale((Values)((power.v + 1023) << 52));
  return exp_reduced(x, to_real(x, power)) * scale;
}

DRIFTWALK_LANES_END
