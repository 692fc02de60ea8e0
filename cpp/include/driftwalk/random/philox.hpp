// Philox 4x32-10 (Salmon et al., "Parallel random numbers: as easy as 1, 2, 3", SC 2011).
//
// Counter-based: a random number is a function of its address, so order, batch size and threads
// cannot change it. Checked against the published vectors of Random123 in cpp/tests.
#pragma once

#include "driftwalk/math/pack.hpp"
#include "driftwalk/random/purpose.hpp"

DRIFTWALK_LANES_BEGIN

template <class UInt>
struct Philox {
  UInt key0, key1;

  // The four words at `counter`; `out` has room for four.
  inline void operator()(UInt c0, UInt c1, UInt c2, UInt c3, UInt* out) const {
    UInt k0 = key0, k1 = key1;
    for (int round = 0; round < 10; ++round) {
      UInt high0, low0, high1, low1;
      multiply_wide(0xD2511F53u, c0, high0, low0);
      multiply_wide(0xCD9E8D57u, c2, high1, low1);
      c0 = high1 ^ c1 ^ k0;
      c1 = low1;
      c2 = high0 ^ c3 ^ k1;
      c3 = low0;
      k0 = k0 + UInt(0x9E3779B9u);
      k1 = k1 + UInt(0xBB67AE85u);
    }
    out[0] = c0;
    out[1] = c1;
    out[2] = c2;
    out[3] = c3;
  }
};

DRIFTWALK_LANES_END
