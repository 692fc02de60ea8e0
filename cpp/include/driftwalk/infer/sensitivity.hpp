// d(state)/d(coefficients, ln C_d): four rows, one column a parameter, carried along with the
// filter.
//
// The columns go through the same drifts, kicks and gains as the mean, with the gains held fixed.
// Each operation is one pass over rows that stay in the first-level cache.
#pragma once

#include "driftwalk/infer/doubles.hpp"
#include "driftwalk/infer/kalman.hpp"
#include "driftwalk/infer/spline_flow.hpp"

DRIFTWALK_LANES_BEGIN

inline void add_four(double* to, Four value) {
  (Four::load(to) + value).store(to);
}

// Adds a strip to the derivatives by the coefficients, of u first and `nodes` further those of v:
// `row_x` of what goes along x, `row_y` along y. The drag depends on u minus the velocity, so with
// scale -1 the strip's response to the velocity gives its response to the flow.
inline void add_share(const StripShare& share, int columns, std::int64_t nodes,
                      const double response[4], double scale, double* row_x, double* row_y) {
  const Four by_x = scale * row_weights.value(share.along_x);
  for (int row = 0; row < 4; ++row) {
    const Four weights = share.weight_y[row] * by_x;
    const std::int64_t u = share.node + std::int64_t(row) * columns, v = u + nodes;
    add_four(row_x + u, response[0] * weights);
    add_four(row_x + v, response[1] * weights);
    add_four(row_y + u, response[2] * weights);
    add_four(row_y + v, response[3] * weights);
  }
}

class Sensitivity {
public:
  explicit Sensitivity(const FilterScratch& scratch)
      : parameters_(scratch.parameters), stride_(scratch.stride),
        rows_{scratch.sensitivity, scratch.sensitivity + scratch.stride,
              scratch.sensitivity + 2 * scratch.stride, scratch.sensitivity + 3 * scratch.stride} {}

  void clear() {
    for (std::int64_t p = 0; p < 4 * stride_; ++p) {
      rows_[0][p] = 0;
    }
  }

  // A drift of the positions, then the part of a kick that is linear in the state.
  void drift_and_kick(double dt, const Kick& kick) {
    const Matrix2 &X = kick.by_position, &V = kick.by_velocity;
    for (std::int64_t p = 0; p < stride_; p += 8) {
      const Eight vx = Eight::load(rows_[2] + p), vy = Eight::load(rows_[3] + p);
      const Eight x = Eight::load(rows_[0] + p) + dt * vx, y = Eight::load(rows_[1] + p) + dt * vy;
      x.store(rows_[0] + p);
      y.store(rows_[1] + p);
      (X[0][0] * x + X[0][1] * y + V[0][0] * vx + V[0][1] * vy).store(rows_[2] + p);
      (X[1][0] * x + X[1][1] * y + V[1][0] * vx + V[1][1] * vy).store(rows_[3] + p);
    }
  }

  // What the parameters themselves add to the velocity in a kick: the flow at each strip, and the
  // drag as a whole.
  void add_flow(const StripShare* shares, int count, int columns, const Kick& kick, double h) {
    const std::int64_t nodes = (parameters_ - 1) / 2;
    const Matrix2& W = kick.inverse;
    for (int k = 0; k < count; ++k) {
      const double* const d = shares[k].response;
      const double damped[4] = {W[0][0] * d[0] + W[0][1] * d[2], W[0][0] * d[1] + W[0][1] * d[3],
                                W[1][0] * d[0] + W[1][1] * d[2], W[1][0] * d[1] + W[1][1] * d[3]};
      add_share(shares[k], columns, nodes, damped, -h, rows_[2], rows_[3]);
    }
    rows_[2][parameters_ - 1] += kick.change[0];
    rows_[3][parameters_ - 1] += kick.change[1];
  }

  void drift(double dt) {
    for (std::int64_t p = 0; p < stride_; p += 8) {
      (Eight::load(rows_[0] + p) + dt * Eight::load(rows_[2] + p)).store(rows_[0] + p);
      (Eight::load(rows_[1] + p) + dt * Eight::load(rows_[3] + p)).store(rows_[1] + p);
    }
  }

  void write_whitened(const Whitening& whiten, double* row_x, double* row_y) const {
    std::int64_t p = 0;
    for (; p + 8 <= parameters_; p += 8) {
      const Eight x = Eight::load(rows_[0] + p) * whiten.per_xx;
      x.store(row_x + p);
      ((Eight::load(rows_[1] + p) - whiten.yx * x) * whiten.per_yy).store(row_y + p);
    }
    for (; p < parameters_; ++p) {
      row_x[p] = rows_[0][p] * whiten.per_xx;
      row_y[p] = (rows_[1][p] - whiten.yx * row_x[p]) * whiten.per_yy;
    }
  }

  void update(const Gain& gain) {
    for (std::int64_t p = 0; p < stride_; p += 8) {
      const Eight x = Eight::load(rows_[0] + p), y = Eight::load(rows_[1] + p);
      for (int a = 0; a < 4; ++a) {
        (Eight::load(rows_[a] + p) - (gain.by_x[a] * x + gain.by_y[a] * y)).store(rows_[a] + p);
      }
    }
  }

private:
  std::int64_t parameters_, stride_;
  double* rows_[4];
};

DRIFTWALK_LANES_END
