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

inline constexpr int most_rows = 4; // that are read at once

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

// As above, for loads of single doubles.
template <int N>
inline void store_parts(DoublePack<N> values, double* at) {
#if defined(DRIFTWALK_USE_X86) && defined(__AVX512F__)
  if constexpr (N == 8) {
    _mm256_storeu_pd(at, _mm512_castpd512_pd256((__m512d)values.v));
    _mm256_storeu_pd(at + 4, _mm512_extractf64x4_pd((__m512d)values.v, 1));
    return;
  }
#endif
  std::memcpy(at, &values.v, sizeof values.v);
}

// Where a lane's cell is: in the one table of all lanes, or in its own.
inline const std::int16_t* cell_of(const std::int16_t* table, int, Int32 at) {
  return table + flow_record * std::int64_t(at);
}
inline const std::int16_t* cell_of(const std::int16_t* const* tables, int lane, Int32 at) {
  return tables[lane] + flow_record * std::int64_t(at);
}

#if defined(DRIFTWALK_USE_X86)
template <class Tables>
inline __m128 load_cell(Tables tables, const Int32* at, int lane) {
  return _mm_loadu_ps(reinterpret_cast<const float*>(cell_of(tables, lane, at[lane])));
}

template <class Tables>
inline void load_cells(Tables tables, const Int32* at, IntPack<4>* out) {
  __m128 r[4];
  for (int k = 0; k < 4; ++k) {
    r[k] = load_cell(tables, at, k);
  }
  _MM_TRANSPOSE4_PS(r[0], r[1], r[2], r[3]);
  for (int k = 0; k < 4; ++k) {
    out[k].v = (typename IntPack<4>::Vector)r[k];
  }
}

#if defined(__AVX2__)
template <class Tables>
inline __m256 load_two_cells(Tables tables, const Int32* at, int lane) {
  return _mm256_insertf128_ps(_mm256_castps128_ps256(load_cell(tables, at, lane)),
                              load_cell(tables, at, lane + 4), 1);
}

template <class Tables>
inline void load_cells(Tables tables, const Int32* at, IntPack<8>* out) {
  __m256 r[4];
  for (int k = 0; k < 4; ++k) {
    r[k] = load_two_cells(tables, at, k);
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
template <class Tables>
inline void load_cells(Tables tables, const Int32* at, IntPack<16>* out) {
  __m512 r[4];
  for (int k = 0; k < 4; ++k) {
    // Halves first: two 16-byte insertions and one of 32 bytes beat three into a 64-byte register.
    const __m256 low = load_two_cells(tables, at, k);
    const __m256 high = load_two_cells(tables, at, k + 8);
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
template <class Tables, int N>
inline void load_cells(Tables tables, const Int32* at, IntPack<N>* out) {
  Int32 columns[4][N];
  for (int lane = 0; lane < N; ++lane) {
    Int32 record[4];
    std::memcpy(record, cell_of(tables, lane, at[lane]), sizeof record);
    for (int k = 0; k < 4; ++k) {
      columns[k][lane] = record[k];
    }
  }
  for (int k = 0; k < 4; ++k) {
    std::memcpy(&out[k].v, columns[k], sizeof columns[k]);
  }
}
#endif

// What stands in a table between two frames: integers are rounded to the nearest, halves away from
// zero.
template <class Real>
inline Real blend(Real before, Real after, Real weight) {
  return before + (after - before) * weight;
}
template <int N>
inline IntPack<N> blend(IntPack<N> before, IntPack<N> after, FloatPack<N> weight) {
  const FloatPack<N> low = to_real(weight, before);
  const FloatPack<N> blended = low + (to_real(weight, after) - low) * weight;
  return truncate(blended + copy_sign(FloatPack<N>(0.5f), blended));
}

// The same as above where each lane has two frames of its own.
template <int N>
inline void load_between(const LaneTables<float>& lanes, const Int32* at, IntPack<N>* out) {
  IntPack<N> before[4], after[4];
  load_cells(lanes.before, at, before);
  load_cells(lanes.after, at, after);
  FloatPack<N> weight;
  std::memcpy(&weight.v, lanes.weight, sizeof weight.v);
  for (int k = 0; k < 4; ++k) {
    const IntPack<N> low = blend((before[k] << 16) >> 16, (after[k] << 16) >> 16, weight);
    const IntPack<N> high = blend(before[k] >> 16, after[k] >> 16, weight);
    out[k] = (high << 16) | (low & IntPack<N>(0xffff));
  }
}

// Keeps the compiler from extracting numbers lane by lane that it has just seen stored: slower.
template <class T>
inline void keep_stored([[maybe_unused]] T& numbers) {
#if defined(DRIFTWALK_USE_X86)
  __asm__("" : "+m"(numbers));
#endif
}

template <int N>
inline IntPack<N> to_fixed_point(FloatPack<N> spacings) {
  return nearest(spacings * 65536.0f);
}

// A row of places, `step` apart: the first and the step, in node spacings from node (0, 0).
template <class Real>
struct FlowRow {
  Real x, y, step_x, step_y;

  FlowRow() = default;
  FlowRow(Real first_x, Real first_y, Real by_x, Real by_y)
      : x(first_x), y(first_y), step_x(by_x), step_y(by_y) {}

  // Another one with the opposite step.
  FlowRow backwards_from(Real first_x, Real first_y) const {
    return {first_x, first_y, -step_x, -step_y};
  }
  void advance() {
    x += step_x;
    y += step_y;
  }
};

// In fixed point.
template <int N>
struct FlowRow<FloatPack<N>> {
  using Real = FloatPack<N>;
  using Int = IntPack<N>;
  Int x, y, step_x, step_y;

  FlowRow() = default;
  FlowRow(Real first_x, Real first_y, Real by_x, Real by_y)
      : x(to_fixed_point(first_x)), y(to_fixed_point(first_y)), step_x(to_fixed_point(by_x)),
        step_y(to_fixed_point(by_y)) {}
  FlowRow(Int first_x, Int first_y, Int by_x, Int by_y)
      : x(first_x), y(first_y), step_x(by_x), step_y(by_y) {}

  FlowRow backwards_from(Real first_x, Real first_y) const {
    return {to_fixed_point(first_x), to_fixed_point(first_y), Int(0) - step_x, Int(0) - step_y};
  }
  void advance() {
    x += step_x;
    y += step_y;
  }
  // The number of the cell.
  Int cell(int stride_bits) const {
    return ((y >> (16 - stride_bits)) & Int(-(1 << stride_bits))) | (x >> 16);
  }
};

// What the corners of a cell count at a place, and the velocities there in units of the table.
template <int N>
struct FlowWeights {
  using Real = FloatPack<N>;
  using Int = IntPack<N>;
  // (fraction, fraction) and (1 - fraction, fraction), kept by wrapping 16-bit additions.
  Int along_x, along_y, step_x, step_y;

  explicit FlowWeights(const FlowRow<Real>& row) {
    const Int flip = Int(0xffff);
    along_x = repeat_low_half(row.x);
    along_y = repeat_low_half(row.y) ^ flip;
    step_x = repeat_low_half(row.step_x);
    step_y = subtract_halves(repeat_low_half(row.step_y) ^ flip, flip);
  }
  void advance() {
    along_x = add_halves(along_x, step_x);
    along_y = add_halves(along_y, step_y);
  }
  // `tables` is one for all lanes or a LaneTables.
  template <class Tables>
  void weigh(const Tables& tables, const Int32* at, Real& u, Real& v) const {
    Int cell[4];
    if constexpr (std::is_pointer_v<Tables>) {
      load_cells(tables, at, cell);
    } else {
      load_between(tables, at, cell);
    }
    const Int vertical = halve_halves(along_y);
    const Int right = multiply_high_halves(vertical, along_x);
    const Int left = subtract_halves(vertical, right);
    u = to_real(u, multiply_add_halves(cell[0], left) + multiply_add_halves(cell[2], right));
    v = to_real(v, multiply_add_halves(cell[1], left) + multiply_add_halves(cell[3], right));
  }
};

inline void look_up(const FlowView<double>& flow, double x, double y, double& u, double& v) {
  const Int32 column = truncate(x), row = truncate(y);
  const double fx = x - column, fy = y - row;
  const std::int64_t place = flow_record * ((std::int64_t(row) << flow.stride_bits) + column);
  double cell[2 * flow_record];
  const double* record = flow.table + place;
  if (flow.lanes != nullptr) {
    for (int k = 0; k < 2 * flow_record; ++k) {
      cell[k] = blend(flow.lanes->before[0][place + k], flow.lanes->after[0][place + k],
                      flow.lanes->weight[0]);
    }
    record = cell;
  }
  const double* next = record + flow_record;
  u = (record[0] * (1 - fx) + next[0] * fx) * (1 - fy) + (record[1] * (1 - fx) + next[1] * fx) * fy;
  v = (record[2] * (1 - fx) + next[2] * fx) * (1 - fy) + (record[3] * (1 - fx) + next[3] * fx) * fy;
}

using FlowRecord = VectorOf<double, flow_record>::type;

// A record of each lane, `of(lane)`, as packs of its four numbers.
template <int N, class Of>
[[gnu::always_inline]] inline void transpose_records(const Of& of, DoublePack<N>* out) {
  if constexpr (N == 8) {
    const auto two = [&](int k) {
#if defined(DRIFTWALK_USE_X86) && defined(__AVX512F__)
      return (typename DoublePack<8>::Vector)_mm512_insertf64x4(
          _mm512_castpd256_pd512((__m256d)of(k)), (__m256d)of(k + 2), 1);
#else
      return __builtin_shufflevector(of(k), of(k + 2), 0, 1, 2, 3, 4, 5, 6, 7);
#endif
    };
    const auto a = two(0), b = two(1), c = two(4), d = two(5);
    const auto even_low = __builtin_shufflevector(a, b, 0, 8, 2, 10, 4, 12, 6, 14);
    const auto odd_low = __builtin_shufflevector(a, b, 1, 9, 3, 11, 5, 13, 7, 15);
    const auto even_high = __builtin_shufflevector(c, d, 0, 8, 2, 10, 4, 12, 6, 14);
    const auto odd_high = __builtin_shufflevector(c, d, 1, 9, 3, 11, 5, 13, 7, 15);
    out[0].v = __builtin_shufflevector(even_low, even_high, 0, 1, 4, 5, 8, 9, 12, 13);
    out[1].v = __builtin_shufflevector(odd_low, odd_high, 0, 1, 4, 5, 8, 9, 12, 13);
    out[2].v = __builtin_shufflevector(even_low, even_high, 2, 3, 6, 7, 10, 11, 14, 15);
    out[3].v = __builtin_shufflevector(odd_low, odd_high, 2, 3, 6, 7, 10, 11, 14, 15);
  } else if constexpr (N == 4) {
    const FlowRecord a = of(0), b = of(1), c = of(2), d = of(3);
    const FlowRecord even_low = __builtin_shufflevector(a, b, 0, 4, 2, 6);
    const FlowRecord odd_low = __builtin_shufflevector(a, b, 1, 5, 3, 7);
    const FlowRecord even_high = __builtin_shufflevector(c, d, 0, 4, 2, 6);
    const FlowRecord odd_high = __builtin_shufflevector(c, d, 1, 5, 3, 7);
    out[0].v = __builtin_shufflevector(even_low, even_high, 0, 1, 4, 5);
    out[1].v = __builtin_shufflevector(odd_low, odd_high, 0, 1, 4, 5);
    out[2].v = __builtin_shufflevector(even_low, even_high, 2, 3, 6, 7);
    out[3].v = __builtin_shufflevector(odd_low, odd_high, 2, 3, 6, 7);
  } else {
    static_assert(N == 2);
    const FlowRecord a = of(0), b = of(1);
    for (int k = 0; k < flow_record; ++k) {
      out[k].v = typename DoublePack<N>::Vector{a[k], b[k]};
    }
  }
}

// What stands at a place of a lane's table or, in a flow in frames, between its two.
inline FlowRecord record_of(const FlowView<double>& flow, int lane, std::int64_t place) {
  FlowRecord found, after;
  if (flow.lanes == nullptr) {
    std::memcpy(&found, flow.table + place, sizeof found);
    return found;
  }
  std::memcpy(&found, flow.lanes->before[lane] + place, sizeof found);
  std::memcpy(&after, flow.lanes->after[lane] + place, sizeof after);
  return blend(found, after, FlowRecord{} + flow.lanes->weight[lane]);
}

// The same for a pack. What a lane's record and the next one come to is found before the lanes are
// transposed: half as many numbers.
template <int N>
[[gnu::always_inline]] inline void look_up(const FlowView<double>& flow, DoublePack<N> x,
                                           DoublePack<N> y, DoublePack<N>& u, DoublePack<N>& v) {
  using Real = DoublePack<N>;
  const IntPack<N> column = narrow(x), row = narrow(y);
  alignas(32) Int32 at[N];
  store_cells((row << flow.stride_bits) + column, at);
  keep_stored(at);
  const Real fx = x - to_real(x, column), fy = y - to_real(y, row);
  const Real left = 1.0 - fx, below = 1.0 - fy;
  alignas(64) double part[N], next_part[N];
  store_parts(left, part);
  store_parts(fx, next_part);
  keep_stored(part);
  keep_stored(next_part);
  Real record[flow_record];
  transpose_records<N>(
      [&](int lane) {
        const std::int64_t place = flow_record * std::int64_t(at[lane]);
        return record_of(flow, lane, place) * part[lane] +
               record_of(flow, lane, place + flow_record) * next_part[lane];
      },
      record);
  u = record[0] * below + record[1] * fy;
  v = record[2] * below + record[3] * fy;
}

// Walks along a row and reads the flow at each place. Velocities come out divided by the table's
// unit.
template <class Real>
class FlowCursor {
public:
  FlowCursor(const FlowView<double>& flow, Real x, Real y, Real step_x, Real step_y)
      : flow_(flow), row_(x, y, step_x, step_y) {}

  void read(Real& u, Real& v) const { look_up(flow_, row_.x, row_.y, u, v); }
  void advance() { row_.advance(); }

private:
  const FlowView<double>& flow_;
  FlowRow<Real> row_;
};

template <int N>
class FlowCursor<FloatPack<N>> {
public:
  using Real = FloatPack<N>;

  FlowCursor(const FlowView<float>& flow, Real x, Real y, Real step_x, Real step_y)
      : flow_(flow), row_(x, y, step_x, step_y), weights_(row_) {}

  void read(Real& u, Real& v) const {
    alignas(64) Int32 at[N];
    store_cells(row_.cell(flow_.stride_bits), at);
    keep_stored(at);
    if (flow_.lanes == nullptr) {
      weights_.weigh(flow_.table, at, u, v);
    } else {
      weights_.weigh(*flow_.lanes, at, u, v);
    }
  }
  void advance() {
    row_.advance();
    weights_.advance();
  }

private:
  const FlowView<float>& flow_;
  FlowRow<Real> row_;
  FlowWeights<N> weights_;
};

// Reads the cells that have been found along rows.
template <int N, class Tables>
inline void weigh_rows(const Tables& tables, const FlowRow<FloatPack<N>>* rows, int row_count,
                       int count, const Int32* found, FloatPack<N>* u, FloatPack<N>* v) {
  for (int r = 0; r < row_count; ++r) {
    FlowWeights<N> weights(rows[r]);
    for (int k = 0; k < count; ++k, found += N) {
      weights.weigh(tables, found, *u++, *v++);
      weights.advance();
    }
  }
}

// The flow along `rows` rows of `count` places, row after row, in units of the table.
//
// Each pass does one thing for all places. Together they would need more registers than there are,
// and every look-up would wait for its cell's number to come back from memory. Not inlined, because
// the caller's numbers would take registers that the passes need.
template <int N>
[[gnu::noinline]] void read_rows(const FlowView<float>& flow, const FlowRow<FloatPack<N>>* rows,
                                 int row_count, int count, FloatPack<N>* u, FloatPack<N>* v) {
  alignas(64) Int32 at[most_rows * most_strips * N];
  const int stride_bits = flow.stride_bits;
  Int32* cell = at;
  for (int r = 0; r < row_count; ++r) {
    FlowRow<FloatPack<N>> row = rows[r];
    for (int k = 0; k < count; ++k, cell += N) {
      store_cells(row.cell(stride_bits), cell);
      row.advance();
    }
  }
  keep_stored(at);
  if (flow.lanes == nullptr) {
    const std::int16_t* const table = flow.table;
    weigh_rows<N>(table, rows, row_count, count, at, u, v);
  } else {
    weigh_rows<N>(*flow.lanes, rows, row_count, count, at, u, v);
  }
}

template <class Real>
inline void walk_rows(const FlowView<double>& flow, const FlowRow<Real>* rows, int row_count,
                      int count, Real* u, Real* v) {
  for (int r = 0; r < row_count; ++r) {
    FlowRow<Real> row = rows[r];
    for (int k = 0; k < count; ++k) {
      look_up(flow, row.x, row.y, *u++, *v++);
      row.advance();
    }
  }
}
inline void read_rows(const FlowView<double>& flow, const FlowRow<double>* rows, int row_count,
                      int count, double* u, double* v) {
  walk_rows(flow, rows, row_count, count, u, v);
}
template <int N>
[[gnu::noinline]] void read_rows(const FlowView<double>& flow, const FlowRow<DoublePack<N>>* rows,
                                 int row_count, int count, DoublePack<N>* u, DoublePack<N>* v) {
  walk_rows(flow, rows, row_count, count, u, v);
}

DRIFTWALK_LANES_END
