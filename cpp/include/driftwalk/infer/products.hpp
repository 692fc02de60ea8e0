// Sums over the samples of products of derivatives: J' J and J' R, J the whitened derivatives of
// the predictions, R a few columns beside them.
//
// Within a second or two the block comes near some of the coefficients only, so that the samples
// are taken some at a time and columns whose derivatives are as good as zero in all of them left
// out.
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
    sums_.size[group] = 1;
    return block_of(group) + 8 * (rows_ + ahead);
  }

  // Takes over the rows that were written, with what stands beside each.
  void add(int rows, const double* right) {
    for (int k = 0; k < rows * sums_.columns; ++k) {
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
    clear();
  }

private:
  static constexpr int most_coordinates = 3;

  // Of eight columns: row by row, so that a product reads memory in order.
  double* block_of(std::int32_t group) const {
    return sums_.rows + std::int64_t(group) * ProductSums::most_rows * 8;
  }

  // Lists the groups of eight columns that count, in order.
  int find_groups() const {
    double most = 0;
    const auto all = static_cast<std::int32_t>(stride_ / 8);
    for (std::int32_t group = 0; group < all; ++group) {
      if (sums_.size[group] == 0) {
        continue;
      }
      Eight size = 0;
      for (int row = 0; row < rows_; ++row) {
        size = at_least(size_of(Eight::load(block_of(group) + 8 * row)), size);
      }
      sums_.size[group] = largest(size);
      most = sums_.size[group] > most ? sums_.size[group] : most;
    }
    int count = 0;
    for (std::int32_t group = 0; group < all; ++group) {
      if (sums_.size[group] > as_good_as_zero * most) {
        sums_.groups[count++] = group;
      }
    }
    return count;
  }

  void multiply(std::int32_t down, std::int32_t across) const {
    Eight block[8];
    for (Eight& line : block) {
      line = Eight(0);
    }
    const double *left = block_of(down), *right = block_of(across);
    for (int k = 0; k < rows_; ++k, left += 8, right += 8) {
      const Eight values = Eight::load(right);
      for (int line = 0; line < 8; ++line) {
        block[line] += left[line] * values;
      }
    }
    for (int line = 0; line < 8; ++line) {
      double* const to =
          sums_.information + (8 * std::int64_t(down) + line) * stride_ + 8 * std::int64_t(across);
      (Eight::load(to) + block[line]).store(to);
    }
  }

  void multiply_beside(std::int32_t group) const {
    for (int column = 0; column < sums_.columns; ++column) {
      Eight sum = 0;
      for (int k = 0; k < rows_; ++k) {
        sum += sums_.beside[k * sums_.columns + column] * Eight::load(block_of(group) + 8 * k);
      }
      double* const to = sums_.products + column * stride_ + 8 * std::int64_t(group);
      (Eight::load(to) + sum).store(to);
    }
  }

  void clear() {
    for (std::int32_t group = 0; group < stride_ / 8; ++group) {
      if (sums_.size[group] != 0) {
        __builtin_memset(block_of(group), 0, sizeof(double) * ProductSums::most_rows * 8);
        sums_.size[group] = 0;
      }
    }
    rows_ = 0;
  }

  ProductSums sums_;
  std::int64_t stride_;
  int rows_ = 0;
};

DRIFTWALK_LANES_END
