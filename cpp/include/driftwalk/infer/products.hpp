// Sums over the samples of products of derivatives: J' J and J' R, J the whitened derivatives of
// the predictions, R a few columns beside them.
//
// Within a second or two the block comes near some of the coefficients only. So the samples are
// taken some at a time, and the columns with derivatives that count are moved together before they
// are multiplied.
//
// From one sample of a fast camera to the next the derivatives hardly change: J' J is then made of
// means over some samples, J' R of all.
#pragma once

#include "driftwalk/infer/problem.hpp"
#include "driftwalk/math/doubles.hpp"

DRIFTWALK_LANES_BEGIN

// Of the largest derivative among the samples that are multiplied at a time.
inline constexpr double as_good_as_zero = 1e-4;

inline Eight size_of(Eight value) {
  return select(value < 0, -value, value);
}

inline double largest(Eight value) {
  double most = value[0];
  for (int lane = 1; lane < 8; ++lane) {
    most = value[lane] > most ? value[lane] : most;
  }
  return most;
}

class Products {
public:
  Products(const ProductSums& sums, std::int64_t stride)
      : sums_(sums), stride_(stride), rows_{sums.rows, sums.written, 0},
        means_{sums.means, sums.written_means, 0} {}

  // Where eight columns of a row are to be written, `ahead` rows beyond those taken over. What is
  // not written is zero.
  double* place(int ahead, std::int32_t group) {
    rows_.written[group] = 1;
    return rows_.of(group) + 8 * (rows_.count + ahead);
  }

  // Takes over the rows that were written, with what stands beside each.
  void add(int rows, const double* right) {
    for (int k = 0; k < rows * sums_.columns; ++k) {
      sums_.beside[rows_.count * sums_.columns + k] = right[k];
    }
    rows_.count += rows;
    per_sample_ = rows;
    if (rows_.count + most_coordinates > ProductSums::most_rows) {
      take_rows();
    }
  }

  // Multiplies what has been collected.
  void flush() {
    take_rows();
    if (sums_.pooled > 1) {
      multiply_all(means_);
    }
  }

private:
  static constexpr int most_coordinates = 3;
  // Sums of eight that stay in the registers.
  static constexpr int lines = native_doubles == 8 ? 8 : 4;

  // Rows by groups of eight columns: so that a product reads memory in order.
  struct Rows {
    double* values;
    std::uint8_t* written;
    int count;
    double* of(std::int64_t group) const { return block_of(values, group); }
  };
  static double* block_of(double* rows, std::int64_t group) {
    return rows + group * ProductSums::most_rows * 8;
  }

  template <class Call>
  void each_written(const Rows& rows, const Call& call) const {
    for (std::int64_t group = 0; group < stride_ / 8; ++group) {
      if (rows.written[group] != 0) {
        call(group);
      }
    }
  }

  void take_rows() {
    multiply_beside();
    if (sums_.pooled == 1) {
      multiply_all(rows_);
      return;
    }
    const int samples = per_sample_ > 0 ? rows_.count / per_sample_ : 0;
    const int pools = static_cast<int>((samples + sums_.pooled - 1) / sums_.pooled);
    if (means_.count + pools * per_sample_ > ProductSums::most_rows) {
      multiply_all(means_);
    }
    take_means(samples, pools);
    clear(rows_);
  }

  // Adds the products with what stands beside, of all columns.
  void multiply_beside() const {
    each_written(rows_, [&](std::int64_t group) {
      const double* const rows = rows_.of(group);
      for (int column = 0; column < sums_.columns; ++column) {
        double* const to = sums_.products + column * stride_ + 8 * group;
        Eight sum = Eight::load(to);
        for (int row = 0; row < rows_.count; ++row) {
          sum += sums_.beside[row * sums_.columns + column] * Eight::load(rows + 8 * row);
        }
        sum.store(to);
      }
    });
  }

  // Means over some samples, each times the root of their number.
  void take_means(int samples, int pools) {
    each_written(rows_, [&](std::int64_t group) {
      means_.written[group] = 1;
      for (int pool = 0; pool < pools; ++pool) {
        const int begin = pool * samples / pools, end = (pool + 1) * samples / pools;
        const double per_root = 1 / __builtin_sqrt(double(end - begin));
        for (int a = 0; a < per_sample_; ++a) {
          Eight sum(0);
          for (int sample = begin; sample < end; ++sample) {
            sum += Eight::load(rows_.of(group) + 8 * (sample * per_sample_ + a));
          }
          (per_root * sum).store(means_.of(group) + 8 * (means_.count + pool * per_sample_ + a));
        }
      }
    });
    means_.count += pools * per_sample_;
  }

  void multiply_all(Rows& rows) {
    const int columns = move_together(rows, note_sizes(rows));
    for (int down = 0; down < columns; down += 8) {
      for (int across = down; across < columns; across += 8) {
        multiply(down, across, columns, rows.count);
      }
    }
    clear(rows);
  }

  // Notes the largest derivative of each column. Returns the largest of all.
  double note_sizes(const Rows& rows) const {
    double most = 0;
    each_written(rows, [&](std::int64_t group) {
      Eight size = 0;
      for (int row = 0; row < rows.count; ++row) {
        size = at_least(size_of(Eight::load(rows.of(group) + 8 * row)), size);
      }
      size.store(sums_.size + 8 * group);
      const double here = largest(size);
      most = here > most ? here : most;
    });
    return most;
  }

  // Copies the columns that count, in order and without gaps. Returns their number.
  int move_together(const Rows& rows, double most) const {
    int count = 0;
    each_written(rows, [&](std::int64_t group) {
      for (std::int64_t column = 8 * group; column < 8 * (group + 1); ++column) {
        if (sums_.size[column] > as_good_as_zero * most) {
          const double* from = rows.of(group) + column % 8;
          double* to = block_of(sums_.dense, count / 8) + count % 8;
          for (int row = 0; row < rows.count; ++row) {
            to[8 * row] = from[8 * row];
          }
          sums_.chosen[count++] = static_cast<std::int32_t>(column);
        }
      }
    });
    return count;
  }

  // Adds the products of up to eight columns with up to eight. What stands in a block beyond the
  // last column is multiplied, too, and not added.
  void multiply(int down, int across, int columns, int rows) const {
    const double* const right = block_of(sums_.dense, across / 8);
    for (int first = 0; first < 8; first += lines) {
      const double* const left = block_of(sums_.dense, down / 8) + first;
      Eight block[lines];
      for (Eight& line : block) {
        line = Eight(0);
      }
      for (int row = 0; row < rows; ++row) {
        const Eight values = Eight::load(right + 8 * row);
        for (int line = 0; line < lines; ++line) {
          block[line] += left[8 * row + line] * values;
        }
      }
      for (int line = 0; line < lines && down + first + line < columns; ++line) {
        double* const to =
            sums_.information + std::int64_t(sums_.chosen[down + first + line]) * stride_;
        double sums[8];
        block[line].store(sums);
        for (int lane = 0; lane < 8 && across + lane < columns; ++lane) {
          to[sums_.chosen[across + lane]] += sums[lane];
        }
      }
    }
  }

  void clear(Rows& rows) const {
    each_written(rows, [&](std::int64_t group) {
      __builtin_memset(rows.of(group), 0, sizeof(double) * std::size_t(8 * rows.count));
      rows.written[group] = 0;
    });
    rows.count = 0;
  }

  ProductSums sums_;
  std::int64_t stride_;
  Rows rows_;
  Rows means_;
  int per_sample_ = 0;
};

DRIFTWALK_LANES_END
