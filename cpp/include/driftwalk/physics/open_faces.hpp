// The drag on several blocks in one go: the strips of their faces that the water reaches, side by
// side, whichever block and world they are of. A covered face adds zeros, so that leaving it out
// changes no bit.
#pragma once

#include "driftwalk/physics/drag.hpp"

DRIFTWALK_LANES_BEGIN

inline constexpr int most_open_blocks = 4; // rows of lanes that are taken together

// Whether moving lanes together costs less than the covered faces do: with the instructions of
// AVX-512 that compress and expand a vector. Lane by lane, a batch of tanks took 1.4 to 1.7 times
// as long with AVX2 as with the covered faces left in.
template <class Real>
inline constexpr bool moves_lanes =
#if defined(DRIFTWALK_USE_X86) && defined(__AVX512F__)
    sizeof(Real) == 64;
#else
    false;
#endif

// The numbers of lanes where the mask holds, one after the other, and back.
template <class T, int N>
class LaneChoice;

#if defined(DRIFTWALK_USE_X86) && defined(__AVX512F__)
template <class T, int N>
class LaneChoice {
public:
  LaneChoice() = default;
  explicit LaneChoice(MaskOf<T, N> mask)
      : bits_(sizeof(T) == 8 ? _mm512_movepi64_mask((__m512i)mask.v)
                             : _mm512_movepi32_mask((__m512i)mask.v)) {}
  int count() const { return __builtin_popcount(bits_); }

  // Writes a whole vector: what follows the chosen ones is void.
  void squeeze(Pack<T, N> all, T* to) const {
    const __m512i chosen = sizeof(T) == 8
                               ? _mm512_maskz_compress_epi64(__mmask8(bits_), (__m512i)all.v)
                               : _mm512_maskz_compress_epi32(__mmask16(bits_), (__m512i)all.v);
    std::memcpy(to, &chosen, sizeof chosen);
  }
  // Zero in the other lanes.
  Pack<T, N> spread(const T* from) const {
    __m512i chosen;
    std::memcpy(&chosen, from, sizeof chosen);
    Pack<T, N> all(typename Pack<T, N>::Vector{});
    all.v = (typename Pack<T, N>::Vector)(
        sizeof(T) == 8 ? _mm512_maskz_expand_epi64(__mmask8(bits_), chosen)
                       : _mm512_maskz_expand_epi32(__mmask16(bits_), chosen));
    return all;
  }

private:
  unsigned bits_ = 0;
};
#endif

template <class Real>
class OpenFaces {
  using T = typename Numbers<Real>::Scalar;
  using Vector = typename Real::Vector;
  using Choice = LaneChoice<T, Numbers<Real>::lanes>;
  static constexpr int lanes = Numbers<Real>::lanes;
  static constexpr int row_words = 4, motion_words = 5;
  static constexpr int room = (4 * most_open_blocks + 1) * lanes;

public:
  // The faces of a row of blocks, one per lane, in the order in which `take` is called.
  void add(const BlockShape<T>& block, const FlowView<T>& flow, Real x, Real y,
           const Axes<Real>& axes, const Motion<Real>& motion,
           const typename Numbers<Real>::Bool* covered) {
    FlowRow<Real> rows[4];
    Real closing[4];
    find_faces(block, flow, x, y, axes, motion, rows, closing);
    Real nx = axes.cosine, ny = axes.sine;
    for (int face = 0; face < 4; ++face) {
      const Choice open(!covered[face]);
      choices_[faces_++] = open;
      const FaceMotion<Real> moving(block, motion, nx, ny, closing[face]);
      squeeze(open, rows[face], words_);
      squeeze(open, moving, words_ + row_words);
      count_ += open.count();
      const Real tx = -ny;
      ny = nx;
      nx = tx;
    }
  }

  template <class Law>
  void sum(const Law& law, const BlockShape<T>& block, const FlowView<T>& flow) {
    if (count_ == 0) {
      return;
    }
    // What fills the last vector repeats a face: it has to be on the table.
    for (T(&word)[room] : words_) {
      const Vector first = Real(word[0]).v;
      std::memcpy(word + count_, &first, sizeof first);
    }
    Real water[2 * most_rows * most_strips];
    Real *const u = water, *const v = water + most_rows * block.strips;
    for (int done = 0; done < count_; done += most_rows * lanes) {
      const int vectors = (count_ - done + lanes - 1) / lanes;
      const int together = vectors < most_rows ? vectors : most_rows;
      FlowRow<Real> rows[most_rows];
      for (int r = 0; r < together; ++r) {
        load(words_, done + r * lanes, rows[r]);
      }
      read_rows(flow, rows, together, block.strips, u, v);
      for (int r = 0; r < together; ++r) {
        FaceMotion<Real> moving;
        load(words_ + row_words, done + r * lanes, moving);
        const FaceSums<Real> sums = sum_face(law, block.strips, flow.unit, moving,
                                             u + r * block.strips, v + r * block.strips);
        store(sums, done + r * lanes);
      }
    }
  }

  // The sums of the next row of blocks, after `sum`.
  DragSums<Real> take(const BlockShape<T>& block, T unit, const Axes<Real>& axes,
                      const Motion<Real>& motion) {
    const Real zero{T(0)};
    DragSums<Real> sums{zero, zero, zero, zero};
    Real nx = axes.cosine, ny = axes.sine;
    for (int face = 0; face < 4; ++face) {
      const Choice& open = choices_[taken_faces_++];
      const FaceMotion<Real> moving(block, motion, nx, ny, zero);
      const T* const at = words_[0] + taken_;
      const FaceSums<Real> found{open.spread(at), open.spread(at + room),
                                 open.spread(at + 2 * room), open.spread(at + 3 * room),
                                 open.spread(at + 4 * room)};
      taken_ += open.count();
      add_face(block, unit, moving, found, sums);
      const Real tx = -ny;
      ny = nx;
      nx = tx;
    }
    return sums;
  }

private:
  // Words of a structure of packs, each in an array of its own.
  template <class Words>
  void squeeze(const Choice& open, const Words& words, T (*to)[room]) const {
    Vector word[sizeof words / sizeof(Vector)];
    std::memcpy(word, &words, sizeof words);
    for (const Vector& one : word) {
      open.squeeze(one, *to++ + count_);
    }
  }
  template <class Words>
  static void load(const T (*from)[room], int at, Words& words) {
    Vector word[sizeof words / sizeof(Vector)];
    for (Vector& one : word) {
      std::memcpy(&one, *from++ + at, sizeof one);
    }
    std::memcpy(&words, word, sizeof words);
  }
  // In place of the words of the same faces, which have been read.
  void store(const FaceSums<Real>& sums, int at) {
    Vector word[sizeof sums / sizeof(Vector)];
    std::memcpy(word, &sums, sizeof sums);
    for (int k = 0; k < row_words + 1; ++k) {
      std::memcpy(words_[k] + at, &word[k], sizeof word[k]);
    }
  }

  T words_[row_words + motion_words][room];
  Choice choices_[4 * most_open_blocks];
  int count_ = 0, faces_ = 0, taken_ = 0, taken_faces_ = 0;
};

DRIFTWALK_LANES_END
