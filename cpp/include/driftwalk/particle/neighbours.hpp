// What other bodies, which move as they were recorded, do to a particle that swims along its
// heading.
//
//   dx = v (e(phi) - push sum of w n) dt,   w = exp(-d / range)
//
// d is how far off another body is, n the unit vector towards it. They push it off at a part of its
// own speed: a particle at rest stays at rest.
#pragma once

#include "driftwalk/particle/numbers.hpp"

DRIFTWALK_LANES_BEGIN

template <class Real>
class Neighbours {
public:
  using T = typename Numbers<Real>::Scalar;
  using Bool = typename Numbers<Real>::Bool;

  Neighbours(const ColumnReader<Real>& columns, const NeighbourTracks& tracks) : tracks_(tracks) {
    push_ = columns(column_neighbour_push);
    per_range_ = Real(T(1)) / max(columns(column_neighbour_range), Real(T(1e-6)));
    felt_ = tracks.count > 0 && any(abs(push_) > Real(T(0)));
  }

  bool felt() const { return felt_; }

  // Adds the velocity at which a particle of this speed is pushed off at the beginning of a step.
  void push_off(std::int64_t step, Real x, Real y, Real speed, Real& u, Real& v) const {
    const std::int64_t row = step < tracks_.steps ? step : tracks_.steps - 1;
    const double* place = tracks_.place + row * 2 * tracks_.count;
    const Real most = push_ * speed;
    for (int k = 0; k < tracks_.count; ++k, place += 2) {
      if (place[0] != place[0]) {
        continue;
      }
      const Real off_x = x - static_cast<T>(place[0]), off_y = y - static_cast<T>(place[1]);
      const Real distance = sqrt(off_x * off_x + off_y * off_y);
      const Real away = -distance * per_range_;
      // Farther off than 12 ranges nobody is felt, whoever else is in the pack.
      const Real strength = select(away > Real(T(-12)), bounded_exp(away), Real(T(0)));
      const Real share = most * strength / max(distance, Real(T(1e-9)));
      u = u + share * off_x;
      v = v + share * off_y;
    }
  }

private:
  NeighbourTracks tracks_;
  Real push_, per_range_;
  bool felt_;
};

DRIFTWALK_LANES_END
