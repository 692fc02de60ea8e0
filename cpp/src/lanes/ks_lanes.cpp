// The KS statistic by bounds and by the sweep, compiled once per instruction set.
#include "driftwalk/stats/ks2d_bounded.hpp"
#include "driftwalk/stats/ks2d_kernel.hpp"

DRIFTWALK_LANES_BEGIN

namespace {
// A point costs what grows with the size of a block, and what grows with the number of blocks over
// their size: so the block grows with the sample. Up to blocks of 256 a place in one fits 8 bits.
template <class Weight>
void sweep_with(const KsSweep& sweep, KsBest best[2]) {
  if (sweep.n <= 1 << 17) {
    KsSweeper<std::int8_t, std::int16_t, Weight, 7>(sweep).run(best);
  } else if (sweep.n <= 1 << 24) {
    KsSweeper<std::int8_t, std::int16_t, Weight, 8>(sweep).run(best);
  } else {
    KsSweeper<std::int16_t, std::int32_t, Weight, 11>(sweep).run(best);
  }
}

// A quadrant is a sum of at most four terms, none beyond the total.
constexpr std::int64_t narrow = std::numeric_limits<std::int32_t>::max() / 4;

void sweep_any(const KsSweep& sweep, KsBest best[2]) {
  if (sweep.total <= narrow) {
    sweep_with<std::int32_t>(sweep, best);
  } else {
    sweep_with<std::int64_t>(sweep, best);
  }
}
} // namespace

DRIFTWALK_LANES_END

void driftwalk::DRIFTWALK_PER_ISA(ks_sweep_)(const KsSweep& sweep, KsBest best[2]) {
  sweep_any(sweep, best);
}

bool driftwalk::DRIFTWALK_PER_ISA(ks_bounded_)(const KsPlain& samples, KsFound found[2],
                                               std::int64_t& tied) {
  return samples.total <= narrow ? KsBounded<std::int32_t>(samples).run(found, tied)
                                 : KsBounded<std::int64_t>(samples).run(found, tied);
}
