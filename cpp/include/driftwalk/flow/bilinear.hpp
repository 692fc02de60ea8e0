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

// The numbers of cells to be looked up, one per lane, as the scalar loads that follow read them.
template <int N>
inline void store_cells(IntPack<N> cell, Int32* at) {
#if defined(DRIFTWALK_USE_X86) && defined(__AVX512F__)
  if constexpr (N == 16) {
    // Two 32-byte stores: one 64-byte store cannot be forwarded to scalar loads.
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(at), _mm512_castsi512_si256((__m512i)cell.v));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(at + 8),
                        _mm512_extracti64x4_epi64((__m512i)cell.v, 1));
    return;
  }
#endif
  std::memcpy(at, &cell.v, sizeof cell.v);
}

#if defined(DRIFTWALK_USE_X86)
inline __m128 load_cell(const std::int16_t* table, Int32 at) {
  return _mm_loadu_ps(reinterpret_cast<const float*>(table + flow_record * std::int64_t(at)));
}

inline void load_cells(const std::int16_t* table, const Int32* at, IntPack<4>* out) {
  __m128 r[4];
  for (int k = 0; k < 4; ++k) {
    r[k] = load_cell(table, at[k]);
  }
  _MM_TRANSPOSE4_PS(r[0], r[1], r[2], r[3]);
  for (int k = 0; k < 4; ++k) {
    out[k].v = (typename IntPack<4>::Vector)r[k];
  }
}

#if defined(__AVX2__)
inline __m256 load_two_cells(const std::int16_t* table, Int32 low, Int32 high) {
  return _mm256_insertf128_ps(_mm256_castps128_ps256(load_cell(table, low)), load_cell(table, high),
                              1);
}

inline void load_cells(const std::int16_t* table, const Int32* at, IntPack<8>* out) {
  __m256 r[4];
  for (int k = 0; k < 4; ++k) {
    r[k] = load_two_cells(table, at[k], at[k + 4]);
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
inline void load_cells(const std::int16_t* table, const Int32* at, IntPack<16>* out) {
  __m512 r[4];
  for (int k = 0; k < 4; ++k) {
    // Halves first: two 16-byte insertions and one of 32 bytes beat three into a 64-byte register.
    const __m256 low = load_two_cells(table, at[k], at[k + 4]);
    const __m256 high = load_two_cells(table, at[k + 8], at[k + 12]);
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
inline void load_cells(const std::int16_t* table, const Int32* at, IntPack<N>* out) {
  Int32 columns[4][N];
  for (int lane = 0; lane < N; ++lane) {
    Int32 record[4];
    std::memcpy(record, table + flow_record * std::int64_t(at[lane]), sizeof record);
    for (int k = 0; k < 4; ++k) {
      columns[k][lane] = record[k];
    }
  }
  for (int k = 0; k < 4; ++k) {
    std::memcpy(&out[k].v, columns[k], sizeof columns[k]);
  }
}
#endif

// Keeps the compiler from extracting numbers lane by lane that it has just seen stored: slower.
template <int Count>
inline void keep_stored(Int32 (&numbers)[Count]) {
#if defined(DRIFTWALK_USE_X86)
  __asm__("" : "+m"(numbers));
#endif
  static_cast<void>(numbers);
}

template <int N>
inline IntPack<N> to_fixed_point(FloatPack<N> spacings) {
  return nearest(spacings * 65536.0f);
}

// Rows of places are read in pieces of so many: what a piece keeps stays in the first cache.
inline constexpr int most_rows = 4, most_read_at_once = 8;

// Walks along the strips of a face, `step` apart, and reads the flow at each; positions are in node
// spacings from node (0, 0). Velocities come out divided by `unit()`.
template <class Real>
class FlowCursor;

template <int N>
class FlowCursor<FloatPack<N>> {
public:
  using Real = FloatPack<N>;
  using Int = IntPack<N>;

  FlowCursor() = default;
  FlowCursor(const FlowView<float>& flow, Real x, Real y, Real step_x, Real step_y)
      : table_(flow.table), row_bits_(16 - flow.stride_bits), row_mask_(-(1 << flow.stride_bits)),
        x_(to_fixed_point(x)), y_(to_fixed_point(y)), dx_(to_fixed_point(step_x)),
        dy_(to_fixed_point(step_y)) {
    // (fraction, fraction) and (1 - fraction, fraction), kept by wrapping 16-bit additions.
    const Int flip = Int(0xffff);
    along_x_ = repeat_low_half(x_);
    along_dx_ = repeat_low_half(dx_);
    along_y_ = repeat_low_half(y_) ^ flip;
    along_dy_ = subtract_halves(repeat_low_half(dy_) ^ flip, flip);
  }

  void read(Real& u, Real& v) const {
    alignas(64) Int32 at[N];
    store_cells(cell(), at);
    keep_stored(at);
    weigh(table_, at, along_x_, along_y_, u, v);
  }

  // The cells of the next `count` places, N numbers each; goes beyond them.
  void locate(int count, Int32* at) {
    // In registers: the compiler cannot know that `at` is not this cursor.
    Int x = x_, y = y_;
    const Int dx = dx_, dy = dy_, row_mask = row_mask_;
    const int row_bits = row_bits_;
    for (int k = 0; k < count; ++k) {
      store_cells(((y >> row_bits) & row_mask) | (x >> 16), at + k * N);
      x += dx;
      y += dy;
    }
    x_ = x;
    y_ = y;
  }

  // The flow at `count` places whose cells `locate` has found.
  void look_up(int count, const Int32* at, Real* u, Real* v) {
    Int along_x = along_x_, along_y = along_y_;
    const Int along_dx = along_dx_, along_dy = along_dy_;
    const std::int16_t* const table = table_;
    for (int k = 0; k < count; ++k) {
      weigh(table, at + k * N, along_x, along_y, u[k], v[k]);
      along_x = add_halves(along_x, along_dx);
      along_y = add_halves(along_y, along_dy);
    }
    along_x_ = along_x;
    along_y_ = along_y;
  }

  void advance() {
    x_ += dx_;
    y_ += dy_;
    advance_weights();
  }

private:
  Int cell() const { return ((y_ >> row_bits_) & row_mask_) | (x_ >> 16); }

  static void weigh(const std::int16_t* table, const Int32* at, Int along_x, Int along_y, Real& u,
                    Real& v) {
    Int cell[4];
    load_cells(table, at, cell);
    const Int vertical = halve_halves(along_y);
    const Int right = multiply_high_halves(vertical, along_x);
    const Int left = subtract_halves(vertical, right);
    u = to_real(u, multiply_add_halves(cell[0], left) + multiply_add_halves(cell[2], right));
    v = to_real(v, multiply_add_halves(cell[1], left) + multiply_add_halves(cell[3], right));
  }

  void advance_weights() {
    along_x_ = add_halves(along_x_, along_dx_);
    along_y_ = add_halves(along_y_, along_dy_);
  }

  const std::int16_t* table_;
  int row_bits_;
  Int row_mask_;
  Int x_, y_, dx_, dy_;
  Int along_x_, along_y_, along_dx_, along_dy_;
};

template <>
class FlowCursor<double> {
public:
  FlowCursor() = default;
  FlowCursor(const FlowView<double>& flow, double x, double y, double step_x, double step_y)
      : flow_(&flow), x_(x), y_(y), dx_(step_x), dy_(step_y) {}

  void read(double& u, double& v) const {
    const Int32 column = truncate(x_), row = truncate(y_);
    const double fx = x_ - column, fy = y_ - row;
    const double* record =
        flow_->table + flow_record * ((std::int64_t(row) << flow_->stride_bits) + column);
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
  const FlowView<double>* flow_;
  double x_, y_, dx_, dy_;
};

// The flow at the next `count` places of several rows, at most most_read_at_once; those of row r
// stand from r * most_read_at_once on.
//
// Each pass does one thing for all places. Together they would need more registers than there are,
// and every look-up would wait for its cell's number to come back from memory. Not inlined, because
// the caller's numbers would take registers that the passes need.
template <int N>
[[gnu::noinline]] void read_rows(FlowCursor<FloatPack<N>>* rows, int row_count, int count,
                                 FloatPack<N>* u, FloatPack<N>* v) {
  alignas(64) Int32 at[most_rows * most_read_at_once * N];
  constexpr int stride = most_read_at_once * N;
  for (int r = 0; r < row_count; ++r) {
    rows[r].locate(count, at + r * stride);
  }
  keep_stored(at);
  for (int r = 0; r < row_count; ++r) {
    rows[r].look_up(count, at + r * stride, u + r * most_read_at_once, v + r * most_read_at_once);
  }
}

inline void read_rows(FlowCursor<double>* rows, int row_count, int count, double* u, double* v) {
  for (int r = 0; r < row_count; ++r) {
    for (int k = 0; k < count; ++k) {
      rows[r].read(u[r * most_read_at_once + k], v[r * most_read_at_once + k]);
      rows[r].advance();
    }
  }
}

DRIFTWALK_LANES_END
