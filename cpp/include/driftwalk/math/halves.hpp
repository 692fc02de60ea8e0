// Arithmetic on the two 16-bit halves of every 32-bit lane: the integer part of the flow lookup.
// Integers round the same way everywhere, so this part is identical on every machine by nature.
#pragma once

#include "driftwalk/math/pack.hpp"

DRIFTWALK_LANES_BEGIN

template <int N>
struct HalvesOf {
  using type = typename VectorOf<std::uint16_t, 2 * N>::type;
};

template <int N>
inline IntPack<N> add_halves(IntPack<N> a, IntPack<N> b) {
  using Halves = typename HalvesOf<N>::type;
  return (typename IntPack<N>::Vector)((Halves)a.v + (Halves)b.v);
}
template <int N>
inline IntPack<N> subtract_halves(IntPack<N> a, IntPack<N> b) {
  using Halves = typename HalvesOf<N>::type;
  return (typename IntPack<N>::Vector)((Halves)a.v - (Halves)b.v);
}
// Every half as an unsigned number, divided by two.
template <int N>
inline IntPack<N> halve_halves(IntPack<N> a) {
  using Halves = typename HalvesOf<N>::type;
  return (typename IntPack<N>::Vector)((Halves)a.v >> 1);
}

// The low half of every lane, in both its halves.
template <int N>
inline IntPack<N> repeat_low_half(IntPack<N> a) {
#if defined(DRIFTWALK_USE_X86)
  using Vector = typename IntPack<N>::Vector;
  constexpr int low = 0xa0; // of two lanes: the first half twice, the third half twice
#if defined(__AVX512BW__)
  if constexpr (N == 16) {
    return (Vector)_mm512_shufflehi_epi16(_mm512_shufflelo_epi16((__m512i)a.v, low), low);
  }
#endif
#if defined(__AVX2__)
  if constexpr (N == 8) {
    return (Vector)_mm256_shufflehi_epi16(_mm256_shufflelo_epi16((__m256i)a.v, low), low);
  }
#endif
  if constexpr (N == 4) {
    return (Vector)_mm_shufflehi_epi16(_mm_shufflelo_epi16((__m128i)a.v, low), low);
  }
#endif
  const IntPack<N> half = a & IntPack<N>(0xffff);
  return half | (half << 16);
}

// The high 16 bits of the product of unsigned halves.
template <int N>
inline IntPack<N> multiply_high_halves(IntPack<N> a, IntPack<N> b) {
  using Vector = typename IntPack<N>::Vector;
#if defined(DRIFTWALK_USE_X86)
#if defined(__AVX512BW__)
  if constexpr (N == 16) {
    return IntPack<N>((Vector)_mm512_mulhi_epu16((__m512i)a.v, (__m512i)b.v));
  }
#endif
#if defined(__AVX2__)
  if constexpr (N == 8) {
    return IntPack<N>((Vector)_mm256_mulhi_epu16((__m256i)a.v, (__m256i)b.v));
  }
#endif
  if constexpr (N == 4) {
    return IntPack<N>((Vector)_mm_mulhi_epu16((__m128i)a.v, (__m128i)b.v));
  }
#endif
  using Words = typename UIntPack<N>::Vector;
  const Words mask = Words{} + 0xffffu;
  const Words low = ((((Words)a.v & mask) * ((Words)b.v & mask)) >> 16) & mask;
  const Words high = (((Words)a.v >> 16) * ((Words)b.v >> 16)) & ~mask;
  return (Vector)(low | high);
}

// Signed halves multiplied and the two products of a lane added.
template <int N>
inline IntPack<N> multiply_add_halves(IntPack<N> a, IntPack<N> b) {
  using Vector = typename IntPack<N>::Vector;
#if defined(DRIFTWALK_USE_X86)
#if defined(__AVX512BW__)
  if constexpr (N == 16) {
    return IntPack<N>((Vector)_mm512_madd_epi16((__m512i)a.v, (__m512i)b.v));
  }
#endif
#if defined(__AVX2__)
  if constexpr (N == 8) {
    return IntPack<N>((Vector)_mm256_madd_epi16((__m256i)a.v, (__m256i)b.v));
  }
#endif
  if constexpr (N == 4) {
    return IntPack<N>((Vector)_mm_madd_epi16((__m128i)a.v, (__m128i)b.v));
  }
#endif
  const Vector a_low = (a.v << 16) >> 16, b_low = (b.v << 16) >> 16;
  return a_low * b_low + (a.v >> 16) * (b.v >> 16);
}

DRIFTWALK_LANES_END
