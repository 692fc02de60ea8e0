// Four or eight doubles at once, in as many of the processor's vectors as they take: the same
// operations in the same order on every instruction set, so the same bits.
//
// Vectors wider than the processor's would do as well, were they not taken apart number by number.
#pragma once

#include "driftwalk/math/pack.hpp"

DRIFTWALK_LANES_BEGIN

template <int N>
struct Doubles {
  static constexpr int width = N < native_doubles ? N : native_doubles;
  static constexpr int parts = N / width;
  using Vector = typename VectorOf<double, width>::type;
  using Words = typename VectorOf<std::int64_t, width>::type;
  Vector part[parts];

  struct Mask {
    Words part[parts];

    bool operator[](int lane) const { return part[lane / width][lane % width] != 0; }
    friend Mask operator&(Mask a, Mask b) {
      return each_mask([&](int k) { return a.part[k] & b.part[k]; });
    }
    friend Mask operator|(Mask a, Mask b) {
      return each_mask([&](int k) { return a.part[k] | b.part[k]; });
    }
    friend Mask operator!(Mask a) {
      return each_mask([&](int k) { return ~a.part[k]; });
    }
  };

  Doubles() = default;
  Doubles(double value) {
    // Not plus zero, which would make an addition of it: that changes -0.
    for (Vector& vector : part) {
      vector = value - Vector{};
    }
  }
  // Vector by vector: a copy of the whole may be made in smaller pieces, and reading it back in
  // larger ones stalls.
  static Doubles load(const double* from) {
    return each([&](int k) {
      Vector vector;
      __builtin_memcpy(&vector, from + k * width, sizeof vector);
      return vector;
    });
  }
  void store(double* to) const {
    for (int k = 0; k < parts; ++k) {
      __builtin_memcpy(to + k * width, &part[k], sizeof(Vector));
    }
  }
  double operator[](int lane) const { return part[lane / width][lane % width]; }

  template <class Make>
  static Doubles each(const Make& make) {
    Doubles out;
    for (int k = 0; k < parts; ++k) {
      out.part[k] = make(k);
    }
    return out;
  }
  template <class Make>
  static Mask each_mask(const Make& make) {
    Mask out;
    for (int k = 0; k < parts; ++k) {
      out.part[k] = (Words)make(k);
    }
    return out;
  }

  friend Doubles operator+(Doubles a, Doubles b) {
    return each([&](int k) { return a.part[k] + b.part[k]; });
  }
  friend Doubles operator-(Doubles a, Doubles b) {
    return each([&](int k) { return a.part[k] - b.part[k]; });
  }
  friend Doubles operator*(Doubles a, Doubles b) {
    return each([&](int k) { return a.part[k] * b.part[k]; });
  }
  friend Doubles operator/(Doubles a, Doubles b) {
    return each([&](int k) { return a.part[k] / b.part[k]; });
  }
  friend Doubles operator-(Doubles a) {
    return each([&](int k) { return -a.part[k]; });
  }
  friend Doubles& operator+=(Doubles& a, Doubles b) { return a = a + b; }
  friend Doubles& operator-=(Doubles& a, Doubles b) { return a = a - b; }
  friend Doubles& operator*=(Doubles& a, Doubles b) { return a = a * b; }

  friend Mask operator<(Doubles a, Doubles b) {
    return each_mask([&](int k) { return a.part[k] < b.part[k]; });
  }
  friend Mask operator>(Doubles a, Doubles b) { return b < a; }
  friend Mask operator==(Doubles a, Doubles b) {
    return each_mask([&](int k) { return a.part[k] == b.part[k]; });
  }

  friend Doubles select(Mask mask, Doubles yes, Doubles no) {
    return each([&](int k) { return mask.part[k] ? yes.part[k] : no.part[k]; });
  }
  // A bound in place of a NaN: the bound comes second, as in pack.hpp.
  friend Doubles at_least(Doubles value, Doubles bound) {
    return select(value > bound, value, bound);
  }
  friend Doubles at_most(Doubles value, Doubles bound) {
    return select(value < bound, value, bound);
  }
};

using Four = Doubles<4>;
using Eight = Doubles<8>;

inline bool any(Eight::Mask mask) {
#if defined(DRIFTWALK_USE_X86) && defined(__AVX512DQ__)
  return _mm512_movepi64_mask((__m512i)mask.part[0]) != 0;
#else
  Eight::Words all = mask.part[0];
  for (int k = 1; k < Eight::parts; ++k) {
    all |= mask.part[k];
  }
  bool found = false;
  for (int lane = 0; lane < Eight::width; ++lane) {
    found |= all[lane] != 0;
  }
  return found;
#endif
}

inline Eight square_root(Eight value) {
#if defined(DRIFTWALK_USE_X86) && defined(__AVX512F__)
  value.part[0] = (Eight::Vector)_mm512_sqrt_pd((__m512d)value.part[0]);
#elif defined(DRIFTWALK_USE_X86) && defined(__AVX2__)
  for (Eight::Vector& vector : value.part) {
    vector = (Eight::Vector)_mm256_sqrt_pd((__m256d)vector);
  }
#else
  for (int lane = 0; lane < 8; ++lane) {
    value.part[lane / Eight::width][lane % Eight::width] = __builtin_sqrt(value[lane]);
  }
#endif
  return value;
}

// Lower half plus upper half.
inline Four fold(Eight value) {
#if defined(DRIFTWALK_USE_X86) && defined(__AVX512F__)
  const __m512d all = (__m512d)value.part[0];
  return Four::each([&](int) {
    return (Four::Vector)_mm512_castpd512_pd256(all) + (Four::Vector)_mm512_extractf64x4_pd(all, 1);
  });
#else
  return Four::each([&](int k) { return value.part[k] + value.part[k + Four::parts]; });
#endif
}
inline double sum(Eight value) {
  const Four four = fold(value);
  return (four[0] + four[2]) + (four[1] + four[3]);
}

DRIFTWALK_LANES_END
