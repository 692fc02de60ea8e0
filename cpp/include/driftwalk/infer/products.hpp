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
  Products(const ProductSums& sums, std::int64_t stride) : sums_(sums), stride_(stride) {}

  // Where eight columns of a row are to be written, `ahead` rows beyond those taken over. What is
  // not written is zero.
  double* place(int ahead, std::int32_t group) {
    sums_.written[group] = 1;
    return block_of(sums_.rows, group) + 8 * (rows_ + ahead);
  }

  // Takes over the rows that were written, with what stands beside each.
  void add(int rows, const double* right) {
    for (int k = 0; k < rows * sums_.columns; ++k) {
      sums_.beside[rows_ * sums_.columns + k] = right[k];
    }
    rows_ += rows;
    per_sample_ = rows;
    if (rows_ + most_coordinates > ProductSums::most_rows) {
      flush();
    }
  }

  // Multiplies what has been collected.
  void flush() {
    const double most = multiply_beside();
    const int columns = sums_.pooled > 1 ? move_means_together(most) : move_together(most);
    for (int down = 0; down < columns; down += 8) {
      for (int across = down; across < columns; across += 8) {
        multiply(down, across, columns);
      }
    }
    clear();
  }

private:
  static constexpr int most_coordinates = 3;
  // Sums of eight that stay in the registers.
  static constexpr int lines = native_doubles == 8 ? 8 : 4;

  // Of eight columns: row by row, so that a product reads memory in order.
  static double* block_of(double* rows, std::int64_t group) {
    return rows + group * ProductSums::most_rows * 8;
  }

  // Adds the products with what stands beside, of all columns. Returns the largest derivative, and
  // notes that of each column.
  double multiply_beside() const {
    double most = 0;
    for (std::int64_t group = 0; group < stride_ / 8; ++group) {
      if (sums_.written[group] == 0) {
        continue;
      }
      const double* const rows = block_of(sums_.rows, group);
      Eight size = 0;
      for (int row = 0; row < rows_; ++row) {
        size = at_least(size_of(Eight::load(rows + 8 * row)), size);
      }
      size.store(sums_.size + 8 * group);
      const double here = largest(size);
      most = here > most ? here : most;
      for (int column = 0; column < sums_.columns; ++column) {
        double* const to = sums_.products + column * stride_ + 8 * group;
        Eight sum = Eight::load(to);
        for (int row = 0; row < rows_; ++row) {
          sum += sums_.beside[row * sums_.columns + column] * Eight::load(rows + 8 * row);
        }
        sum.store(to);
      }
    }
    return most;
  }

  // Copies the columns that count, in order and without gaps. Returns their number.
  int move_together(double most) {
    dense_rows_ = rows_;
    return each_that_counts(most, [&](const double* from, double* to) {
      for (int row = 0; row < rows_; ++row) {
        to[8 * row] = from[8 * row];
      }
    });
  }

  // The same of the means over some samples, each times the root of their number.
  int move_means_together(double most) {
    const std::int64_t samples = per_sample_ > 0 ? rows_ / per_sample_ : 0;
    const std::int64_t pools = (samples + sums_.pooled - 1) / sums_.pooled;
    dense_rows_ = int(pools) * per_sample_;
    return each_that_counts(most, [&](const double* from, double* to) {
      for (std::int64_t pool = 0; pool < pools; ++pool) {
        const std::int64_t begin = pool * samples / pools, end = (pool + 1) * samples / pools;
        const double per_root = 1 / __builtin_sqrt(double(end - begin));
        for (int a = 0; a < per_sample_; ++a) {
          double sum = 0;
          for (std::int64_t sample = begin; sample < end; ++sample) {
            sum += from[8 * (sample * per_sample_ + a)];
          }
          to[8 * (pool * per_sample_ + a)] = sum * per_root;
        }
      }
    });
  }

  // Calls `move` for every column that counts with its place and its place among those. Returns
  // their number.
  template <class Move>
  int each_that_counts(double most, const Move& move) const {
    int count = 0;
    for (std::int64_t group = 0; group < stride_ / 8; ++group) {
      if (sums_.written[group] == 0) {
        continue;
      }
      for (std::int64_t column = 8 * group; column < 8 * (group + 1); ++column) {
        if (sums_.size[column] > as_good_as_zero * most) {
          move(block_of(sums_.rows, group) + column % 8,
               block_of(sums_.dense, count / 8) + count % 8);
          sums_.chosen[count++] = static_cast<std::int32_t>(column);
        }
      }
    }
    return count;
  }

  // Adds the products of up to eight columns with up to eight. What stands in a block beyond the
  // last column is multiplied, too, and not added.
  void multiply(int down, int across, int columns) const {
    const double* const right = block_of(sums_.dense, across / 8);
    for (int first = 0; first < 8; first += lines) {
      const double* const left = block_of(sums_.dense, down / 8) + first;
      Eight block[lines];
      for (Eight& line : block) {
        line = Eight(0);
      }
      for (int row = 0; row < dense_rows_; ++row) {
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

  void clear() {
    for (std::int64_t group = 0; group < stride_ / 8; ++group) {
      if (sums_.written[group] != 0) {
        __builtin_memset(block_of(sums_.rows, group), 0,
                         sizeof(double) * ProductSums::most_rows * 8);
        sums_.written[group] = 0;
      }
    }
    rows_ = 0;
  }

  ProductSums sums_;
  std::int64_t stride_;
  int rows_ = 0;
  int per_sample_ = 0;
  int dense_rows_ = 0; // those that are multiplied
};

DRIFTWALK_LANES_END
