// d(state)/d(coefficients, ln C_d): 2 D rows, one column a parameter, carried along with the
// filter.
//
// The columns go through the same drifts, kicks and gains as the mean, with the gains held fixed.
// The samples that follow make the filter forget: columns that the block has left behind become as
// good as zero, are set to zero now and then, and left out until they are touched again.
#pragma once

#include "driftwalk/infer/kalman.hpp"
#include "driftwalk/infer/spline_flow.hpp"
#include "driftwalk/math/doubles.hpp"

DRIFTWALK_LANES_BEGIN

inline void add_four(double* to, Four value) {
  (Four::load(to) + value).store(to);
}

// Adds a strip to the derivatives by the coefficients, of u first and `nodes` further those of v:
// rows[a] of what goes along coordinate a. The drag depends on u minus the velocity, so with scale
// -1 the strip's response to the velocity gives its response to the flow.
template <int D>
inline void add_share(const StripShare<D>& share, int columns, std::int64_t nodes,
                      const double (&response)[D][2], double scale, double* const* rows) {
  const Four by_x = scale * row_weights.value(share.along_x);
  for (int row = 0; row < 4; ++row) {
    const Four weights = share.weight_y[row] * by_x;
    const std::int64_t u = share.node + std::int64_t(row) * columns, v = u + nodes;
    for (int a = 0; a < D; ++a) {
      add_four(rows[a] + u, response[a][0] * weights);
      add_four(rows[a] + v, response[a][1] * weights);
    }
  }
}

// Below it a derivative of the state by a coefficient [m / (m/s), m/s / (m/s), ...] counts as zero.
inline constexpr double forgotten = 1e-10;
inline constexpr int samples_between_forgetting = 16;

// Adds a point of the water's acceleration, with factors for the spline's value and its derivative
// along the flow.
template <int D>
inline void add_point(const PointShare<D>& point, int columns, std::int64_t nodes,
                      const double (&by_value)[D][2], const double (&by_slope)[D][2],
                      double* const* rows) {
  const Four weight_x = Four::load(point.weight_x), slope_x = Four::load(point.slope_x);
  for (int row = 0; row < 4; ++row) {
    const Four value = point.weight_y[row] * weight_x;
    const Four slope =
        (point.u * point.weight_y[row]) * slope_x + (point.v * point.slope_y[row]) * weight_x;
    const std::int64_t u = point.node + std::int64_t(row) * columns, v = u + nodes;
    for (int a = 0; a < D; ++a) {
      add_four(rows[a] + u, by_value[a][0] * value + by_slope[a][0] * slope);
      add_four(rows[a] + v, by_value[a][1] * value + by_slope[a][1] * slope);
    }
  }
}

// As many columns as the processor takes at once: eight of them in two vectors are copied through
// memory where they stand in arrays.
using Columns = Doubles<native_doubles>;

template <int D, int F>
class Sensitivity {
public:
  // The sensitivities are those of an earlier run of the same scratch, or zero.
  explicit Sensitivity(const FilterScratch<D>& scratch)
      : parameters_(scratch.parameters), nodes_((scratch.parameters - 1) / (2 * scratch.layers)),
        stride_(scratch.stride), touched_(scratch.touched), active_(scratch.active) {
    for (int a = 0; a < 2 * D + F; ++a) {
      rows_[a] = scratch.sensitivity + a * scratch.stride;
    }
    list_active();
  }

  void clear() {
    for (int k = 0; k < count_; ++k) {
      clear_group(active_[k]);
    }
    count_ = 0;
  }

  // A drift of the coordinates, then the part of a kick that is linear in the state.
  void drift_and_kick(double dt, const Kick<D>& kick) {
    each_active([&](std::int64_t p) {
      Columns coordinates[D], velocities[D], after[D];
      for (int a = 0; a < D; ++a) {
        velocities[a] = Columns::load(rows_[a + D] + p);
        coordinates[a] = Columns::load(rows_[a] + p) + dt * velocities[a];
      }
      kick_linear<D, Columns>(kick, coordinates, velocities, after);
      if constexpr (F == 2) {
        push(kick, p, coordinates, after);
      }
      for (int a = 0; a < D; ++a) {
        coordinates[a].store(rows_[a] + p);
        after[a].store(rows_[a + D] + p);
      }
    });
  }

  // What the parameters themselves add to the velocity in a kick: the flow at each strip and point,
  // by layer, and the drag as a whole.
  void add_flow(const FilterScratch<D>& scratch, const DragResponse<D>& drag, int columns,
                const Kick<D>& kick, double h) {
    if (scratch.layers == 1) {
      add_strips(scratch.shares, drag.shares, columns, kick, -h, 0);
      add_points(scratch.points, drag.points, columns, kick, h, 0, 0);
    }
    for (int layer = 0; scratch.layers > 1 && layer < scratch.layers; ++layer) {
      const double weight = scratch.weight[layer], rate = scratch.weight_rate[layer];
      const std::int64_t first = 2 * nodes_ * layer;
      if (weight != 0) {
        add_strips(scratch.shares, drag.shares, columns, kick, -h * weight, first);
      }
      if (weight != 0 || rate != 0) {
        add_points(scratch.points, drag.points, columns, kick, h * weight, h * rate, first);
      }
    }
    touch_group((parameters_ - 1) / 8);
    for (int a = 0; a < D; ++a) {
      rows_[a + D][parameters_ - 1] += kick.by_log_drag[a];
    }
  }

  void drift(double dt) {
    each_active([&](std::int64_t p) {
      for (int a = 0; a < D; ++a) {
        (Columns::load(rows_[a] + p) + dt * Columns::load(rows_[a + D] + p)).store(rows_[a] + p);
      }
    });
  }

  // L^-1 d(prediction), eight columns of row a at place(a, group); other columns are zero.
  template <class Place>
  void write_whitened(const Innovation<D>& e, const Place& place) const {
    for (int k = 0; k < count_; ++k) {
      const std::int64_t first = 8 * std::int64_t(active_[k]);
      double* to[D];
      for (int a = 0; a < D; ++a) {
        to[a] = place(a, active_[k]);
      }
      for (int column = 0; column < 8; column += native_doubles) {
        // One by one, as an array of them would go through memory.
        const auto row = [&](int a) { return Columns::load(rows_[a] + first + column); };
        const Columns white_x = row(0) * e.per_root[0];
        const Columns white_y = (row(1) - e.L[1][0] * white_x) * e.per_root[1];
        white_x.store(to[0] + column);
        white_y.store(to[1] + column);
        if constexpr (D == 3) {
          const Columns rest = row(2) - e.L[2][0] * white_x;
          ((rest - e.L[2][1] * white_y) * e.per_root[2]).store(to[2] + column);
        }
      }
    }
  }

  // Adds the columns of a row that are not zero to a sum of such rows.
  void add_row(const double* row, double* sum) const {
    for (int k = 0; k < count_; ++k) {
      const std::int64_t first = 8 * std::int64_t(active_[k]);
      const std::int64_t end = first + 8 < parameters_ ? first + 8 : parameters_;
      for (std::int64_t column = first; column < end; ++column) {
        sum[column] += row[column];
      }
    }
  }

  void update(const Gain<D, F>& gain) {
    each_active([&](std::int64_t p) {
      Columns coordinates[D];
      for (int a = 0; a < D; ++a) {
        coordinates[a] = Columns::load(rows_[a] + p);
      }
      for (int row = 0; row < 2 * D + F; ++row) {
        Columns change = gain.by[row][0] * coordinates[0];
        for (int a = 1; a < D; ++a) {
          change += gain.by[row][a] * coordinates[a];
        }
        (Columns::load(rows_[row] + p) - change).store(rows_[row] + p);
      }
    });
  }

  // Sets columns that are as good as zero to zero.
  void forget() {
    int kept = 0;
    for (int k = 0; k < count_; ++k) {
      Eight::Mask large = Eight(0) < Eight(0);
      for (const double* row : rows_) {
        const Eight value = Eight::load(row + 8 * std::int64_t(active_[k]));
        large = large | (value > forgotten) | (value < -forgotten);
      }
      if (any(large)) {
        active_[kept++] = active_[k];
      } else {
        clear_group(active_[k]);
      }
    }
    count_ = kept;
  }

private:
  // Calls with the place of each few columns that are not zero.
  template <class Call>
  void each_active(const Call& call) const {
    for (int k = 0; k < count_; ++k) {
      const std::int64_t first = 8 * std::int64_t(active_[k]);
      for (int column = 0; column < 8; column += native_doubles) {
        call(first + column);
      }
    }
  }

  // `first` is the column of the layer's first coefficient.
  void add_strips(const StripShare<D>* shares, int count, int columns, const Kick<D>& kick,
                  double scale, std::int64_t first) {
    double* rows[D];
    rows_from(first, rows);
    for (int k = 0; k < count; ++k) {
      touch(first + shares[k].node, columns);
      touch(first + shares[k].node + nodes_, columns);
      double damped[D][2] = {};
      for (int a = 0; a < D; ++a) {
        for (int c = 0; c < D; ++c) {
          damped[a][0] += kick.inverse[a][c] * shares[k].response[c][0];
          damped[a][1] += kick.inverse[a][c] * shares[k].response[c][1];
        }
      }
      add_share<D>(shares[k], columns, nodes_, damped, scale, rows);
    }
  }

  void add_points(const PointShare<D>* points, int count, int columns, const Kick<D>& kick,
                  double scale, double rate, std::int64_t first) {
    double* rows[D];
    rows_from(first, rows);
    for (int k = 0; k < count; ++k) {
      touch(first + points[k].node, columns);
      touch(first + points[k].node + nodes_, columns);
      double by_value[D][2] = {}, by_slope[D][2] = {};
      for (int a = 0; a < D; ++a) {
        for (int c = 0; c < D; ++c) {
          for (int along = 0; along < 2; ++along) {
            by_value[a][along] += scale * kick.inverse[a][c] * points[k].by_value[c][along];
            by_slope[a][along] += scale * kick.inverse[a][c] * points[k].by_slope[c][along];
            if (rate != 0) {
              by_value[a][along] += rate * kick.inverse[a][c] * points[k].by_rate[c][along];
            }
          }
        }
      }
      add_point<D>(points[k], columns, nodes_, by_value, by_slope, rows);
    }
  }

  // The rows of the velocities from a column on.
  void rows_from(std::int64_t first, double* (&rows)[D]) const {
    for (int a = 0; a < D; ++a) {
      rows[a] = rows_[a + D] + first;
    }
  }

  // The remembered force's part of a kick.
  void push(const Kick<D>& kick, std::int64_t p, Columns (&coordinates)[D], Columns (&after)[D]) {
    Columns force[2];
    for (int f = 0; f < 2; ++f) {
      force[f] = Columns::load(rows_[2 * D + f] + p);
      (kick.force_kept * force[f]).store(rows_[2 * D + f] + p);
    }
    push_linear<D, Columns>(kick, force, coordinates, after);
  }

  void list_active() {
    count_ = 0;
    for (std::int64_t group = 0; group < stride_ / 8; ++group) {
      if (touched_[group] != 0) {
        active_[count_++] = static_cast<std::int32_t>(group);
      }
    }
  }

  void clear_group(std::int32_t group) {
    touched_[group] = 0;
    for (double* row : rows_) {
      Eight(0).store(row + 8 * std::int64_t(group));
    }
  }

  void touch_group(std::int64_t group) {
    if (touched_[group] == 0) {
      touched_[group] = 1;
      active_[count_++] = static_cast<std::int32_t>(group);
    }
  }

  // The 4 x 4 columns from the one of a node on.
  void touch(std::int64_t node, int columns) {
    for (int row = 0; row < 4; ++row, node += columns) {
      touch_group(node / 8);
      touch_group((node + 3) / 8);
    }
  }

  std::int64_t parameters_, nodes_, stride_;
  std::uint8_t* touched_;
  std::int32_t* active_;
  int count_ = 0;
  double* rows_[2 * D + F];
};

DRIFTWALK_LANES_END
