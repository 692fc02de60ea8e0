// Sums over the samples of products of derivatives: J' J and J' R, J the whitened derivatives of
// the predictions, R a few columns beside them.
//
// Within a second or two the block comes near some of the coefficients only, so that the samples
// are taken some at a time and columns whose derivatives are as good as zero in all of them left
// out.
#pragma once

#include "driftwalk/infer/doubles.hpp"
#include "driftwalk/infer/problem.hpp"

DRIFTWALK_LANES_BEGIN

// Of the largest derivative among the samples that are multiplied at a time.
inline constexpr double as_good_as_zero = 1e-7;

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

  // Where the next row of derivatives is to be written, `stride` numbers.
  double* row(int ahead) const { return sums_.rows + (rows_ + ahead) * stride_; }

  // Takes over the rows that were written, `right` columns beside each.
  void add(int rows, const double* right) {
    for (std::int64_t k = 0; k < rows * sums_.columns; ++k) {
      sums_.beside[rows_ * sums_.columns + k] = right[k];
    }
    rows_ += rows;
    if (rows_ + most_coordinates > ProductSums::most_rows) {
      flush();
    }
  }

  // Multiplies what has been collected.
  void flush() {
    const int groups = find_groups();
    for (int i = 0; i < groups; ++i) {
      multiply_beside(sums_.groups[i]);
      for (int j = i; j < groups; ++j) {
        multiply(sums_.groups[i], sums_.groups[j]);
      }
    }
    rows_ = 0;
  }

private:
  static constexpr int most_coordinates = 3;

  // Lists the groups of eight columns that count, in order.
  int find_groups() const {
    double most = 0;
    const std::int64_t all = stride_ / 8;
    for (std::int64_t group = 0; group < all; ++group) {
      Eight size = 0;
      for (int row = 0; row < rows_; ++row) {
        size = at_least(size_of(Eight::load(sums_.rows + row * stride_ + 8 * group)), size);
      }
      sums_.size[group] = largest(size);
      most = sums_.size[group] > most ? sums_.size[group] : most;
    }
    int count = 0;
    for (std::int64_t group = 0; group < all; ++group) {
      if (sums_.size[group] > as_good_as_zero * most) {
        sums_.groups[count++] = static_cast<std::int32_t>(group);
      }
    }
    return count;
  }

  void multiply(std::int32_t down, std::int32_t across) const {
    Eight block[8];
    for (Eight& line : block) {
      line = Eight(0);
    }
    const double* row = sums_.rows;
    for (int k = 0; k < rows_; ++k, row += stride_) {
      const Eight right = Eight::load(row + 8 * across);
      for (int line = 0; line < 8; ++line) {
        block[line] += row[8 * down + line] * right;
      }
    }
    for (int line = 0; line < 8; ++line) {
      double* const to = sums_.information + (8 * std::int64_t(down) + line) * stride_ + 8 * across;
      (Eight::load(to) + block[line]).store(to);
    }
  }

  void multiply_beside(std::int32_t group) const {
    for (int column = 0; column < sums_.columns; ++column) {
      Eight sum = 0;
      for (int k = 0; k < rows_; ++k) {
        sum += sums_.beside[k * sums_.columns + column] *
               Eight::load(sums_.rows + k * stride_ + 8 * group);
      }
      double* const to = sums_.products + column * stride_ + 8 * group;
      (Eight::load(to) + sum).store(to);
    }
  }

  ProductSums sums_;
  std::int64_t stride_;
  int rows_ = 0;
};

DRIFTWALK_LANES_END
