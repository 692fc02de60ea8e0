// Bilinear lookup of the flow along a row of strips.
//
// The batch kernels read a table of 16-bit integers: one record of four per node,
//     (u_j, u_j+1, v_j, v_j+1)   node j and its upper neighbour, in units of max|u| / 32767,
// so one unaligned 16-byte load at node i gives nodes i and i+1, the whole cell, both components,
// and the table of a 50 x 50 grid stays in the first cache. Positions are 16.16 fixed point in node
// spacings; the four weights are 15-bit integers that sum to 32767. The double reference reads the
// same quantised nodes in plain arithmetic. Tables are padded (cpp/src/prepare.cpp), so a block
// whose centre is on the grid has every strip on it.
#pragma once

#include "driftwalk/math/halves.hpp"
#include "driftwalk/simulate/prepared.hpp"

DRIFTWALK_LANES_BEGIN

#if defined(DRIFTWALK_USE_X86)
inline void load_cells(const std::int16_t* table, IntPack<4> index, IntPack<4>* out) {
  alignas(16) Int32 at[4];
  std::memcpy(at, &index.v, sizeof at);
  __asm__("" : "+m"(at)); // keep the store: extracting lanes one by one is slower
  __m128 r[4];
  for (int k = 0; k < 4; ++k) {
    r[k] = _mm_loadu_ps(reinterpret_cast<const float*>(table + flow_record * std::int64_t(at[k])));
  }
  _MM_TRANSPOSE4_PS(r[0], r[1], r[2], r[3]);
  for (int k = 0; k < 4; ++k) {
    out[k].v = (typename IntPack<4>::Vector)r[k];
  }
}

#if defined(__AVX2__)
inline void load_cells(const std::int16_t* table, IntPack<8> index, IntPack<8>* out) {
  alignas(32) Int32 at[8];
  std::memcpy(at, &index.v, sizeof at);
  __asm__("" : "+m"(at));
  const auto cell = [&](int lane) {
    return _mm_loadu_ps(
        reinterpret_cast<const float*>(table + flow_record * std::int64_t(at[lane])));
  };
  __m256 r[4];
  for (int k = 0; k < 4; ++k) {
    r[k] = _mm256_insertf128_ps(_mm256_castps128_ps256(cell(k)), cell(k + 4), 1);
  }
  const __m256 t0 = _mm256_unpacklo_ps(r[0], r[1]), t1 = _mm256_unpackhi_ps(r[0], r[1]);
  const __m256 t2 = _mm256_unpacklo_ps(r[2], r[3]), t3 = _mm256_unpackhi_ps(r[2], r[3]);
  using Vector = typename IntPack<8>::Vector;
  out[0].v = (Vector)_mm256_shuffle_ps(t0, t2, 0x44);
  out[1].v = (Vector)_mm256_shuffle_ps(t0, t2, 0xee);
  out[2].v = (Vector)_mm256_shuffle_ps(t1, t3, 0x44);
  out[3].v = (Vector)_mm256_shuffle_ps(t1, t3, 0xee);
}
#endif

#if defined(__AVX512F__)
inline void load_cells(const std::int16_t* table, IntPack<16> index, IntPack<16>* out) {
  // Two 32-byte stores: one 64-byte store cannot be forwarded to the scalar loads that follow.
  alignas(64) Int32 at[16];
  _mm256_store_si256(reinterpret_cast<__m256i*>(at), _mm512_castsi512_si256((__m512i)index.v));
  _mm256_store_si256(reinterpret_cast<__m256i*>(at + 8),
                     _mm512_extracti64x4_epi64((__m512i)index.v, 1));
  __asm__("" : "+m"(at));
  const auto cell = [&](int lane) {
    return _mm_loadu_ps(
        reinterpret_cast<const float*>(table + flow_record * std::int64_t(at[lane])));
  };
  __m512 r[4];
  for (int k = 0; k < 4; ++k) {
    // Halves first: two 16-byte insertions and one of 32 bytes beat three into a 64-byte register.
    const __m256 low = _mm256_insertf128_ps(_mm256_castps128_ps256(cell(k)), cell(k + 4), 1);
    const __m256 high = _mm256_insertf128_ps(_mm256_castps128_ps256(cell(k + 8)), cell(k + 12), 1);
    r[k] = _mm512_insertf32x8(_mm512_castps256_ps512(low), high, 1);
  }
  const __m512 t0 = _mm512_unpacklo_ps(r[0], r[1]), t1 = _mm512_unpackhi_ps(r[0], r[1]);
  const __m512 t2 = _mm512_unpacklo_ps(r[2], r[3]), t3 = _mm512_unpackhi_ps(r[2], r[3]);
  using Vector = typename IntPack<16>::Vector;
  out[0].v = (Vector)_mm512_shuffle_ps(t0, t2, 0x44);
  out[1].v = (Vector)_mm512_shuffle_ps(t0, t2, 0xee);
  out[2].v = (Vector)_mm512_shuffle_ps(t1, t3, 0x44);
  out[3].v = (Vector)_mm512_shuffle_ps(t1, t3, 0xee);
}
#endif
#else
template <int N>
inline void load_cells(const std::int16_t* table, IntPack<N> index, IntPack<N>* out) {
  Int32 columns[4][N];
  for (int lane = 0; lane < N; ++lane) {
    Int32 record[4];
    std::memcpy(record, table + flow_record * std::int64_t(index.v[lane]), sizeof record);
    for (int k = 0; k < 4; ++k) {
      columns[k][lane] = record[k];
    }
  }
  for (int k = 0; k < 4; ++k) {
    std::memcpy(&out[k].v, columns[k], sizeof columns[k]);
  }
}
#endif

template <int N>
inline IntPack<N> to_fixed_point(FloatPack<N> spacings) {
  return nearest(spacings * 65536.0f);
}

// Walks along the strips of a face, `step` apart, and reads the flow at each; positions are in node
// spacings from node (0, 0). Velocities come out divided by `unit()`.
template <class Real>
class FlowCursor;

template <int N>
class FlowCursor<FloatPack<N>> {
public:
  using Real = FloatPack<N>;
  using Int = IntPack<N>;

  FlowCursor(const FlowView<float>& flow, Real x, Real y, Real step_x, Real step_y)
      : flow_(flow), x_(to_fixed_point(x)), y_(to_fixed_point(y)), dx_(to_fixed_point(step_x)),
        dy_(to_fixed_point(step_y)) {
    // (fraction, fraction) and (1 - fraction, fraction), kept by wrapping 16-bit additions.
    along_x_ = spread(x_);
    along_dx_ = spread(dx_);
    const Int flip = Int(0xffff);
    along_y_ = spread(y_) ^ flip;
    along_dy_ = subtract_halves((spread(dy_) & Int(Int32(0xffff0000))), spread(dy_) & flip);
  }

  void read(Real& u, Real& v) const {
    const Int row = (y_ >> (16 - flow_.stride_bits)) & Int(-(1 << flow_.stride_bits));
    Int cell[4];
    load_cells(flow_.table, row + (x_ >> 16), cell);
    const Int vertical = halve_halves(along_y_);
    const Int right = multiply_high_halves(vertical, along_x_);
    const Int left = subtract_halves(vertical, right);
    u = to_real(u, multiply_add_halves(cell[0], left) + multiply_add_halves(cell[2], right));
    v = to_real(v, multiply_add_halves(cell[1], left) + multiply_add_halves(cell[3], right));
  }

  void advance() {
    x_ += dx_;
    y_ += dy_;
    along_x_ = add_halves(along_x_, along_dx_);
    along_y_ = add_halves(along_y_, along_dy_);
  }

private:
  static Int spread(Int fixed) {
    const Int low = fixed & Int(0xffff);
    return low | (low << 16);
  }

  const FlowView<float>& flow_;
  Int x_, y_, dx_, dy_;
  Int along_x_, along_y_, along_dx_, along_dy_;
};

template <>
class FlowCursor<double> {
public:
  FlowCursor(const FlowView<double>& flow, double x, double y, double step_x, double step_y)
      : flow_(flow), x_(x), y_(y), dx_(step_x), dy_(step_y) {}

  void read(double& u, double& v) const {
    const Int32 column = truncate(x_), row = truncate(y_);
    const double fx = x_ - column, fy = y_ - row;
    const double* record =
        flow_.table + flow_record * ((std::int64_t(row) << flow_.stride_bits) + column);
    const double* next = record + flow_record;
    u = (record[0] * (1 - fx) + next[0] * fx) * (1 - fy) +
        (record[1] * (1 - fx) + next[1] * fx) * fy;
    v = (record[2] * (1 - fx) + next[2] * fx) * (1 - fy) +
        (record[3] * (1 - fx) + next[3] * fx) * fy;
  }

  void advance() {
    x_ += dx_;
    y_ += dy_;
  }

private:
  const FlowView<double>& flow_;
  double x_, y_, dx_, dy_;
};

DRIFTWALK_LANES_END
