// Sorting one axis of a sample: two passes of a radix sort on the leading bits, then a repair of
// the few places where those bits agree.
#include "driftwalk/stats/ks2d_order.hpp"

#include <algorithm>
#include <bit>
#include <limits>

namespace driftwalk {
namespace {

constexpr int digit_bits = 11;
constexpr std::uint64_t digit_count = 1u << digit_bits;
constexpr int leading_bits = 2 * digit_bits;
// Below this the tables of the radix sort cost more than a comparison sort.
constexpr std::int64_t radix_from = 512;

// Integers in the order of the numbers; -0.0 + 0.0 is +0.0.
std::uint64_t key_of(double value) {
  const std::uint64_t bits = std::bit_cast<std::uint64_t>(value + 0.0);
  const std::uint64_t sign = std::uint64_t(std::int64_t(bits) >> 63);
  return bits ^ (sign | 0x8000000000000000u);
}

struct KeyedIndex {
  std::uint64_t key;
  std::int32_t index;
  bool operator<(const KeyedIndex& other) const {
    return key != other.key ? key < other.key : index < other.index;
  }
};

void comparison_sort(KsSortedAxis& axis, std::int64_t n) {
  std::vector<KeyedIndex> items(static_cast<std::size_t>(n));
  for (std::int64_t i = 0; i < n; ++i) {
    items[i] = {axis.key[i], axis.index[i]};
  }
  std::sort(items.begin(), items.end());
  for (std::int64_t i = 0; i < n; ++i) {
    axis.key[i] = items[i].key;
    axis.index[i] = items[i].index;
  }
}

// Insertion sort of what is nearly in order; where it is not, as when many keys agree in their
// leading bits, a comparison sort takes over.
void repair_order(KsSortedAxis& axis, std::int64_t n) {
  constexpr std::int64_t moves_per_point = 8;
  std::int64_t moves_left = moves_per_point * n;
  std::uint64_t* const keys = axis.key.data();
  std::int32_t* const indices = axis.index.data();
  for (std::int64_t i = 1; i < n; ++i) {
    if (keys[i - 1] <= keys[i]) {
      continue;
    }
    const std::uint64_t key = keys[i];
    const std::int32_t index = indices[i];
    std::int64_t j = i;
    for (; j > 0 && keys[j - 1] > key; --j) {
      keys[j] = keys[j - 1];
      indices[j] = indices[j - 1];
    }
    keys[j] = key;
    indices[j] = index;
    moves_left -= i - j;
    if (moves_left < 0) {
      comparison_sort(axis, n);
      return;
    }
  }
}

void exclusive_sums(std::uint32_t counts[digit_count]) {
  std::uint32_t sum = 0;
  for (std::uint64_t digit = 0; digit < digit_count; ++digit) {
    const std::uint32_t count = counts[digit];
    counts[digit] = sum;
    sum += count;
  }
}

// Order (leading bits << 32 | index) by the leading bits of key - smallest.
void radix_sort(std::int64_t n, std::uint64_t smallest, int shift, KsSortScratch& scratch) {
  std::uint32_t low[digit_count] = {};
  std::uint32_t high[digit_count] = {};
  for (std::int64_t i = 0; i < n; ++i) {
    const std::uint64_t lead = (scratch.key[i] - smallest) >> shift;
    ++low[lead & (digit_count - 1)];
    ++high[lead >> digit_bits];
  }
  exclusive_sums(low);
  exclusive_sums(high);
  std::uint64_t* const middle = scratch.from.data();
  std::uint64_t* const sorted = scratch.to.data();
  for (std::int64_t i = 0; i < n; ++i) {
    const std::uint64_t lead = (scratch.key[i] - smallest) >> shift;
    middle[low[lead & (digit_count - 1)]++] = lead << 32 | std::uint64_t(i);
  }
  for (std::int64_t i = 0; i < n; ++i) {
    const std::uint64_t item = middle[i];
    sorted[high[item >> (32 + digit_bits)]++] = item;
  }
}

} // namespace

void ks_sort(const double* values, std::int64_t n, KsSortScratch& scratch, KsSortedAxis& axis) {
  ks_grow(axis.key, n);
  ks_grow(axis.index, n);
  if (n < radix_from) {
    for (std::int64_t i = 0; i < n; ++i) {
      axis.key[i] = key_of(values[i]);
      axis.index[i] = std::int32_t(i);
    }
    comparison_sort(axis, n);
    return;
  }
  ks_grow(scratch.key, n);
  ks_grow(scratch.from, n);
  ks_grow(scratch.to, n);
  std::uint64_t smallest = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t largest = 0;
  for (std::int64_t i = 0; i < n; ++i) {
    const std::uint64_t key = key_of(values[i]);
    scratch.key[i] = key;
    smallest = std::min(smallest, key);
    largest = std::max(largest, key);
  }
  const int shift = std::max(0, int(std::bit_width(largest - smallest)) - leading_bits);
  radix_sort(n, smallest, shift, scratch);
  const std::uint64_t* const sorted = scratch.to.data();
  for (std::int64_t i = 0; i < n; ++i) {
    const std::int32_t index = std::int32_t(sorted[i]);
    axis.index[i] = index;
    axis.key[i] = scratch.key[index];
  }
  repair_order(axis, n);
}

void ks_sort(const double* x, const double* y, std::int64_t n, KsSortScratch& scratch,
             KsSortedSample& sample) {
  sample.n = n;
  ks_sort(x, n, scratch, sample.x);
  ks_sort(y, n, scratch, sample.y);
}

} // namespace driftwalk
