// Random numbers and columns of particles, one per lane.
#pragma once

#include "driftwalk/particle/columns.hpp"
#include "driftwalk/simulate/run.hpp"

DRIFTWALK_LANES_BEGIN

// Reads columns of a pack of worlds. Lanes beyond the last world repeat it.
template <class Real>
class ColumnReader {
public:
  ColumnReader(const BatchWorlds& worlds, std::int64_t first, int count)
      : worlds_(worlds), first_(first), count_(count) {}

  Real operator()(int column) const {
    return of(worlds_.particle.values + std::int64_t(column) * worlds_.count);
  }
  Real of(const double* values) const {
    constexpr int lanes = Numbers<Real>::lanes;
    double row[lanes];
    for (int lane = 0; lane < lanes; ++lane) {
      row[lane] = values[first_ + (lane < count_ ? lane : count_ - 1)];
    }
    Real out;
    load_lanes(row, out);
    return out;
  }
  Philox<typename Numbers<Real>::UInt> stream() const {
    constexpr int lanes = Numbers<Real>::lanes;
    UInt32 low[lanes], high[lanes];
    for (int lane = 0; lane < lanes; ++lane) {
      const std::uint64_t key = worlds_.key[first_ + (lane < count_ ? lane : count_ - 1)];
      low[lane] = static_cast<UInt32>(key);
      high[lane] = static_cast<UInt32>(key >> 32);
    }
    Philox<typename Numbers<Real>::UInt> found;
    std::memcpy(&found.key0, low, sizeof low);
    std::memcpy(&found.key1, high, sizeof high);
    return found;
  }

private:
  const BatchWorlds& worlds_;
  std::int64_t first_;
  int count_;
};

// Four uniform numbers in (0, 1] of a purpose at a position of its stream, beside its normals.
template <class Real>
inline void draw_uniforms(const Philox<typename Numbers<Real>::UInt>& stream, Purpose purpose,
                          std::int64_t index, Real* out) {
  using UInt = typename Numbers<Real>::UInt;
  using T = typename Numbers<Real>::Scalar;
  UInt words[4];
  stream(UInt(static_cast<UInt32>(index)), UInt(static_cast<UInt32>(1)),
         UInt(static_cast<UInt32>(index >> 32)), UInt(static_cast<UInt32>(purpose)), words);
  for (int k = 0; k < 4; ++k) {
    out[k] = (to_real(Real(), as_signed(words[k] >> 8)) + T(1)) * T(0x1p-24);
  }
}

// exp(-dt / time): what is kept of the last value over a step; nothing where the time is 0.
template <class Real, class T>
inline Real kept_over(T dt, Real time) {
  const Real zero{T(0)};
  const Real steps = Real(dt) / max(time, Real(T(1e-9)));
  return select(time > zero, exp(max(-steps, Real(T(-80)))), zero);
}

// The mean over a step of what starts at 1 and relaxes to 0: (1 - exp(-z)) / z, z = dt / time.
template <class Real, class T>
inline Real mean_over(T dt, Real time, Real kept) {
  const Real one{T(1)}, zero{T(0)};
  const Real z = Real(dt) / max(time, Real(T(1e-9)));
  // Of the difference of two numbers that are almost 1, a series keeps all digits.
  const Real third = one - z * T(0.25) * (one - z * T(0.2));
  const Real small = one - z * T(0.5) * (one - z * T(1.0 / 3.0) * third);
  const Real mean = select(z < Real(T(0.02)), small, (one - kept) / z);
  return select(time > zero, mean, zero);
}

// What a fresh normal number adds, so that the spread stays the same.
template <class Real>
inline Real fresh_with(Real kept) {
  using T = typename Numbers<Real>::Scalar;
  return sqrt(max(Real(T(1)) - kept * kept, Real(T(0))));
}

// The spread of the logarithm of a log-normal number with this spread over its mean.
template <class Real>
inline Real log_std_of(Real cv) {
  using T = typename Numbers<Real>::Scalar;
  return sqrt(max(log(cv * cv + T(1)), Real(T(0))));
}

// A number of turns without the whole ones: from -1/2 to 1/2.
template <class Real>
inline Real part_of_turn(Real turns) {
  using T = typename Numbers<Real>::Scalar;
  const Real bounded = clamp_to(turns, T(-1e6), T(1e6));
  return turns - to_real(turns, truncate(bounded + copy_sign(Real(T(0.5)), bounded)));
}

// The same of an angle [rad].
template <class Real>
inline Real without_turns(Real angle) {
  using T = typename Numbers<Real>::Scalar;
  return part_of_turn(angle * static_cast<T>(0.5 / pi_value)) * static_cast<T>(2 * pi_value);
}

// exp that stays a number, whatever comes in.
template <class Real>
inline Real bounded_exp(Real x) {
  using T = typename Numbers<Real>::Scalar;
  return exp(clamp_to(x, T(-80), T(80)));
}

DRIFTWALK_LANES_END
