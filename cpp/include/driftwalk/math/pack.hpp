// A pack of lanes, one world per lane, and the same operations on a single number.
//
// Physics is written once over a number type `Real`: Pack<float, W> in the batch kernels, double in
// the reference, Pack<double, W> (double_pack.hpp) where a batch has its bits, float in a GPU
// thread. Branches are select(mask, a, b). Only what the compiler does not see by itself is written
// with intrinsics, and each has a plain form behind it.
#pragma once

#include "driftwalk/config.hpp"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <type_traits>

#if !defined(DRIFTWALK_PORTABLE) && (defined(__SSE2__) || defined(__AVX2__))
#include <immintrin.h>
#define DRIFTWALK_USE_X86 1
#endif

DRIFTWALK_LANES_BEGIN

using Int32 = std::int32_t;
using UInt32 = std::uint32_t;

template <class T, int N>
struct VectorOf {
  using type [[gnu::vector_size(N * sizeof(T))]] = T;
};

template <class T, int N>
struct Pack {
  static constexpr int lanes = N;
  using Scalar = T;
  using Vector = typename VectorOf<T, N>::type;
  Vector v;

  Pack() = default;
  DRIFTWALK_HD Pack(Vector value) : v(value) {}
  // Of doubles minus zero: plus zero changes -0, which a single double keeps.
  DRIFTWALK_HD Pack(T value) : v(sizeof(T) == 8 ? value - Vector{} : Vector{} + value) {}

  T operator[](int lane) const { return v[lane]; }
  void set(int lane, T value) { v[lane] = value; }
};

template <int N>
using FloatPack = Pack<float, N>;
template <int N>
using IntPack = Pack<Int32, N>;
template <int N>
using UIntPack = Pack<UInt32, N>;

// Doubles of one of the processor's vectors.
#if defined(DRIFTWALK_USE_X86) && defined(__AVX512F__)
inline constexpr int native_doubles = 8;
#elif defined(__AVX2__)
inline constexpr int native_doubles = 4;
#else
inline constexpr int native_doubles = 2;
#endif

// Integers as wide as a number.
template <class T>
using SignedAs = std::conditional_t<sizeof(T) == 8, std::int64_t, Int32>;
template <class T>
using UnsignedAs = std::make_unsigned_t<SignedAs<T>>;

// A comparison of packs: all bits set in the lanes where it holds.
template <int N, class Word = Int32>
struct Mask {
  using Vector = typename VectorOf<Word, N>::type;
  Vector v;
};
template <class T, int N>
using MaskOf = Mask<N, SignedAs<T>>;

// The companions of a number type: its mask, its integers, its scalar.
template <class Real>
struct Numbers {
  static constexpr int lanes = 1;
  using Scalar = Real;
  using Bool = bool;
  using Int = Int32;
  using UInt = UInt32;
};
template <class T, int N>
struct Numbers<Pack<T, N>> {
  static constexpr int lanes = N;
  using Scalar = T;
  using Bool = MaskOf<T, N>;
  using Int = Pack<SignedAs<T>, N>;
  using UInt = Pack<UnsignedAs<T>, N>;
};

#define DRIFTWALK_BINARY(op)                                                                       \
  template <class T, int N>                                                                        \
  inline Pack<T, N> operator op(Pack<T, N> a, Pack<T, N> b) {                                      \
    return a.v op b.v;                                                                             \
  }                                                                                                \
  template <class T, int N>                                                                        \
  inline Pack<T, N> operator op(Pack<T, N> a, std::type_identity_t<T> b) {                         \
    return a.v op Pack<T, N>(b).v;                                                                 \
  }                                                                                                \
  template <class T, int N>                                                                        \
  inline Pack<T, N> operator op(std::type_identity_t<T> a, Pack<T, N> b) {                         \
    return Pack<T, N>(a).v op b.v;                                                                 \
  }
DRIFTWALK_BINARY(+)
DRIFTWALK_BINARY(-)
DRIFTWALK_BINARY(*)
DRIFTWALK_BINARY(/)
DRIFTWALK_BINARY(&)
DRIFTWALK_BINARY(|)
DRIFTWALK_BINARY(^)
#undef DRIFTWALK_BINARY

template <class T, int N>
inline Pack<T, N> operator-(Pack<T, N> a) {
  return -a.v;
}
template <class T, int N>
inline Pack<T, N> operator<<(Pack<T, N> a, int bits) {
  return a.v << bits;
}
template <class T, int N>
inline Pack<T, N> operator>>(Pack<T, N> a, int bits) {
  return a.v >> bits;
}
template <class T, int N>
inline Pack<T, N>& operator+=(Pack<T, N>& a, Pack<T, N> b) {
  a.v += b.v;
  return a;
}

#define DRIFTWALK_COMPARE(op)                                                                      \
  template <class T, int N>                                                                        \
  inline MaskOf<T, N> operator op(Pack<T, N> a, Pack<T, N> b) {                                    \
    return {(typename MaskOf<T, N>::Vector)(a.v op b.v)};                                          \
  }                                                                                                \
  template <class T, int N>                                                                        \
  inline MaskOf<T, N> operator op(Pack<T, N> a, std::type_identity_t<T> b) {                       \
    return a op Pack<T, N>(b);                                                                     \
  }
DRIFTWALK_COMPARE(<)
DRIFTWALK_COMPARE(>)
DRIFTWALK_COMPARE(<=)
DRIFTWALK_COMPARE(>=)
DRIFTWALK_COMPARE(==)
DRIFTWALK_COMPARE(!=)
#undef DRIFTWALK_COMPARE

template <int N, class Word>
inline Mask<N, Word> operator&(Mask<N, Word> a, Mask<N, Word> b) {
  return {a.v & b.v};
}
template <int N, class Word>
inline Mask<N, Word> operator|(Mask<N, Word> a, Mask<N, Word> b) {
  return {a.v | b.v};
}
template <int N, class Word>
inline Mask<N, Word> operator!(Mask<N, Word> a) {
  return {~a.v};
}

// --- select, any -------------------------------------------------------------------------------
template <class T, int N>
inline Pack<T, N> select(MaskOf<T, N> mask, Pack<T, N> yes, Pack<T, N> no) {
  return mask.v ? yes.v : no.v;
}
template <class T>
DRIFTWALK_HD inline T select(bool mask, T yes, T no) {
  return mask ? yes : no;
}

DRIFTWALK_HD inline bool any(bool mask) {
  return mask;
}
template <int N>
inline bool any(Mask<N> mask) {
#if defined(DRIFTWALK_USE_X86)
#if defined(__AVX512F__)
  if constexpr (N == 16) {
    return _mm512_test_epi32_mask((__m512i)mask.v, (__m512i)mask.v) != 0;
  }
#endif
#if defined(__AVX__)
  if constexpr (N == 8) {
    return _mm256_movemask_ps((__m256)mask.v) != 0;
  }
#endif
  if constexpr (N == 4) {
    return _mm_movemask_ps((__m128)mask.v) != 0;
  }
#endif
  Int32 all = 0;
  for (int lane = 0; lane < N; ++lane) {
    all |= mask.v[lane];
  }
  return all != 0;
}

// --- max, min, square root ---------------------------------------------------------------------
// max(a, b) is a > b ? a : b, so a NaN in `a` gives b: clamps put the bound second.
template <int N>
inline FloatPack<N> max(FloatPack<N> a, FloatPack<N> b) {
#if defined(DRIFTWALK_USE_X86)
#if defined(__AVX512F__)
  if constexpr (N == 16) {
    return FloatPack<N>((typename FloatPack<N>::Vector)_mm512_max_ps((__m512)a.v, (__m512)b.v));
  }
#endif
#if defined(__AVX__)
  if constexpr (N == 8) {
    return FloatPack<N>((typename FloatPack<N>::Vector)_mm256_max_ps((__m256)a.v, (__m256)b.v));
  }
#endif
  if constexpr (N == 4) {
    return FloatPack<N>((typename FloatPack<N>::Vector)_mm_max_ps((__m128)a.v, (__m128)b.v));
  }
#endif
  return a.v > b.v ? a.v : b.v;
}
template <int N>
inline FloatPack<N> min(FloatPack<N> a, FloatPack<N> b) {
#if defined(DRIFTWALK_USE_X86)
#if defined(__AVX512F__)
  if constexpr (N == 16) {
    return FloatPack<N>((typename FloatPack<N>::Vector)_mm512_min_ps((__m512)a.v, (__m512)b.v));
  }
#endif
#if defined(__AVX__)
  if constexpr (N == 8) {
    return FloatPack<N>((typename FloatPack<N>::Vector)_mm256_min_ps((__m256)a.v, (__m256)b.v));
  }
#endif
  if constexpr (N == 4) {
    return FloatPack<N>((typename FloatPack<N>::Vector)_mm_min_ps((__m128)a.v, (__m128)b.v));
  }
#endif
  return a.v < b.v ? a.v : b.v;
}
template <int N>
inline FloatPack<N> sqrt(FloatPack<N> a) {
#if defined(DRIFTWALK_USE_X86)
#if defined(__AVX512F__)
  if constexpr (N == 16) {
    return FloatPack<N>((typename FloatPack<N>::Vector)_mm512_sqrt_ps((__m512)a.v));
  }
#endif
#if defined(__AVX__)
  if constexpr (N == 8) {
    return FloatPack<N>((typename FloatPack<N>::Vector)_mm256_sqrt_ps((__m256)a.v));
  }
#endif
  if constexpr (N == 4) {
    return FloatPack<N>((typename FloatPack<N>::Vector)_mm_sqrt_ps((__m128)a.v));
  }
#endif
  FloatPack<N> root;
  for (int lane = 0; lane < N; ++lane) {
    root.v[lane] = __builtin_sqrtf(a.v[lane]);
  }
  return root;
}
template <class T>
  requires std::is_floating_point_v<T>
DRIFTWALK_HD inline T max(T a, T b) {
  return a > b ? a : b;
}
template <class T>
  requires std::is_floating_point_v<T>
DRIFTWALK_HD inline T min(T a, T b) {
  return a < b ? a : b;
}
DRIFTWALK_HD inline double sqrt(double a) {
  return __builtin_sqrt(a);
}
DRIFTWALK_HD inline float sqrt(float a) {
  return __builtin_sqrtf(a);
}

template <int N>
inline FloatPack<N> abs(FloatPack<N> a) {
  typedef typename IntPack<N>::Vector Bits;
  return (typename FloatPack<N>::Vector)((Bits)a.v & 0x7fffffff);
}
DRIFTWALK_HD inline double abs(double a) {
  return a < 0 ? -a : a;
}
DRIFTWALK_HD inline float abs(float a) {
  return a < 0 ? -a : a;
}

// `magnitude` with the sign of `sign`; a zero counts as positive or negative by its sign bit.
template <int N>
inline FloatPack<N> copy_sign(FloatPack<N> magnitude, FloatPack<N> sign) {
  typedef typename IntPack<N>::Vector Bits;
  const Bits mask = Bits{} + Int32(0x80000000);
  return (typename FloatPack<N>::Vector)(((Bits)magnitude.v & ~mask) | ((Bits)sign.v & mask));
}
DRIFTWALK_HD inline double copy_sign(double a, double s) {
  return __builtin_copysign(a, s);
}
DRIFTWALK_HD inline float copy_sign(float a, float s) {
  return __builtin_copysignf(a, s);
}

// --- conversions -------------------------------------------------------------------------------
template <int N>
inline IntPack<N> truncate(FloatPack<N> a) {
  return __builtin_convertvector(a.v, typename IntPack<N>::Vector);
}
DRIFTWALK_HD inline Int32 truncate(double a) {
  return static_cast<Int32>(a);
}
DRIFTWALK_HD inline Int32 truncate(float a) {
  return static_cast<Int32>(a);
}

// The nearest integer, halves to the even one (the rounding mode that every program starts with).
template <int N>
inline IntPack<N> nearest(FloatPack<N> a) {
#if defined(DRIFTWALK_USE_X86)
  using Vector = typename IntPack<N>::Vector;
#if defined(__AVX512F__)
  if constexpr (N == 16) {
    return IntPack<N>((Vector)_mm512_cvtps_epi32((__m512)a.v));
  }
#endif
#if defined(__AVX__)
  if constexpr (N == 8) {
    return IntPack<N>((Vector)_mm256_cvtps_epi32((__m256)a.v));
  }
#endif
  if constexpr (N == 4) {
    return IntPack<N>((Vector)_mm_cvtps_epi32((__m128)a.v));
  }
#endif
  FloatPack<N> whole = a;
  for (int lane = 0; lane < N; ++lane) {
    whole.set(lane, __builtin_rintf(a[lane]));
  }
  return truncate(whole);
}

template <int N>
inline FloatPack<N> to_real(FloatPack<N>, IntPack<N> a) {
  return __builtin_convertvector(a.v, typename FloatPack<N>::Vector);
}
template <class T>
  requires std::is_floating_point_v<T>
DRIFTWALK_HD inline T to_real(T, Int32 a) {
  return static_cast<T>(a);
}

template <class T, int N>
inline Pack<SignedAs<T>, N> as_signed(Pack<T, N> a) {
  return (typename Pack<SignedAs<T>, N>::Vector)a.v;
}
DRIFTWALK_HD inline Int32 as_signed(UInt32 a) {
  return static_cast<Int32>(a);
}

// The product of two 32-bit words, as its high and its low word.
template <int N>
inline void multiply_wide(UInt32 a, UIntPack<N> b, UIntPack<N>& high, UIntPack<N>& low) {
  low = UIntPack<N>(a) * b;
#if defined(DRIFTWALK_USE_X86)
#if defined(__AVX512F__)
  if constexpr (N == 16) {
    const __m512i factor = _mm512_set1_epi32(Int32(a));
    const __m512i even = _mm512_mul_epu32(factor, (__m512i)b.v);
    const __m512i odd = _mm512_mul_epu32(factor, _mm512_srli_epi64((__m512i)b.v, 32));
    high = (typename UIntPack<N>::Vector)_mm512_mask_blend_epi32(0xaaaa,
                                                                 _mm512_srli_epi64(even, 32), odd);
    return;
  }
#endif
#if defined(__AVX2__)
  if constexpr (N == 8) {
    const __m256i factor = _mm256_set1_epi32(Int32(a));
    const __m256i even = _mm256_mul_epu32(factor, (__m256i)b.v);
    const __m256i odd = _mm256_mul_epu32(factor, _mm256_srli_epi64((__m256i)b.v, 32));
    high = (typename UIntPack<N>::Vector)_mm256_blend_epi32(_mm256_srli_epi64(even, 32), odd, 0xaa);
    return;
  }
#endif
  if constexpr (N == 4) {
    const __m128i factor = _mm_set1_epi32(Int32(a));
    const __m128i even = _mm_mul_epu32(factor, (__m128i)b.v);
    const __m128i odd = _mm_mul_epu32(factor, _mm_srli_epi64((__m128i)b.v, 32));
    const __m128i upper = _mm_set_epi32(-1, 0, -1, 0);
    high = (typename UIntPack<N>::Vector)_mm_or_si128(_mm_srli_epi64(even, 32),
                                                      _mm_and_si128(odd, upper));
    low = (typename UIntPack<N>::Vector)_mm_or_si128(_mm_andnot_si128(upper, even),
                                                     _mm_slli_epi64(odd, 32));
    return;
  }
#endif
  for (int lane = 0; lane < N; ++lane) {
    high.v[lane] = static_cast<UInt32>((std::uint64_t(a) * b.v[lane]) >> 32);
  }
}
DRIFTWALK_HD inline void multiply_wide(UInt32 a, UInt32 b, UInt32& high, UInt32& low) {
  const std::uint64_t product = std::uint64_t(a) * b;
  high = static_cast<UInt32>(product >> 32);
  low = static_cast<UInt32>(product);
}

// --- loading one number per lane from an array of doubles ---------------------------------------
template <class T, int N>
inline void load_lanes(const double* values, Pack<T, N>& out) {
  for (int lane = 0; lane < N; ++lane) {
    out.v[lane] = static_cast<T>(values[lane]);
  }
}
DRIFTWALK_HD inline void load_lanes(const double* values, double& out) {
  out = values[0];
}

template <class T, int N>
inline T lane_of(Pack<T, N> a, int lane) {
  return a.v[lane];
}
DRIFTWALK_HD inline double lane_of(double a, int) {
  return a;
}
template <int N, class Word>
inline bool lane_of(Mask<N, Word> a, int lane) {
  return a.v[lane] != 0;
}
DRIFTWALK_HD inline bool lane_of(bool a, int) {
  return a;
}

DRIFTWALK_LANES_END
