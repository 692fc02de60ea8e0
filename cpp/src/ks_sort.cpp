// Sorting one axis of a sample: two passes of a radix sort on leading bits, then a repair of the
// few places where those bits agree. A sample too large for the processor's inner caches is dealt
// to parts first, and each part sorted by its next bits.
//
// The leading bits ("lead") of a number are its place on an even scale from the smallest to the
// largest number, or, where a few far numbers would crowd the others on such a scale, the first
// bits of its floating-point form, which is a scale of even ratios.
#include "driftwalk/stats/ks2d_order.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <limits>

namespace driftwalk {
namespace {

// Below this the tables of the radix sort cost more than a comparison sort.
constexpr std::int64_t radix_from = 128;
// What is sorted in one part, and the aim for the size of a part where there are many.
constexpr int place_bits = 18;
constexpr std::int64_t largest_part = 1 << place_bits;
constexpr int part_bits = 10;
// Fewer parts wait for each other's counters; more write to more pages of memory than a processor
// keeps in view.
constexpr int least_deal_bits = 8;
constexpr int most_deal_bits = 9;
// Parts up to this size are sorted by short digits: the tables of long ones would cost more.
constexpr std::int64_t short_digits_to = 1 << 12;
constexpr int short_digit = 8;
constexpr int long_digit = 11;
constexpr int lead_bits = most_deal_bits + 2 * long_digit;
static_assert(long_digit + place_bits <= 32); // what goes through memory between the passes

// Integers in the order of the numbers; -0.0 + 0.0 is +0.0.
constexpr std::uint64_t sign_bit = 0x8000000000000000u;
std::uint64_t key_of(double value) {
  const std::uint64_t bits = std::bit_cast<std::uint64_t>(value + 0.0);
  const std::uint64_t sign = std::uint64_t(std::int64_t(bits) >> 63);
  return bits ^ (sign | sign_bit);
}
double value_of(std::uint64_t key) {
  const std::uint64_t sign = std::uint64_t(std::int64_t(~key) >> 63);
  return std::bit_cast<double>(key ^ (sign | sign_bit));
}

// What is to be sorted: numbers as they come, or a part of an axis.
struct Numbers {
  const double* values;
  double value(std::int64_t i) const { return values[i]; }
  std::uint64_t key(std::int64_t i) const { return key_of(values[i]); }
  std::int32_t from(std::int64_t i) const { return std::int32_t(i); }
  template <class Lead>
  std::uint32_t lead(const Lead& lead, std::int64_t i) const {
    return lead.of_value(values[i]);
  }
};
struct Part {
  const std::uint64_t* keys;
  const std::int32_t* places;
  double value(std::int64_t i) const { return value_of(keys[i]); }
  std::uint64_t key(std::int64_t i) const { return keys[i]; }
  std::int32_t from(std::int64_t i) const { return places[i]; }
  template <class Lead>
  std::uint32_t lead(const Lead& lead, std::int64_t i) const {
    return lead.of_key(keys[i]);
  }
};

struct Range {
  double smallest;
  double largest;
};

// Several at a time: each waits for its last comparison.
template <class Source>
Range range_of(const Source& source, std::int64_t n) {
  constexpr std::int64_t lanes = 8;
  double smallest[lanes];
  double largest[lanes];
  for (std::int64_t lane = 0; lane < lanes; ++lane) {
    smallest[lane] = largest[lane] = source.value(0);
  }
  const auto look_at = [&](std::int64_t lane, double value) {
    smallest[lane] = value < smallest[lane] ? value : smallest[lane];
    largest[lane] = value > largest[lane] ? value : largest[lane];
  };
  std::int64_t i = 0;
  for (; i + lanes <= n; i += lanes) {
    for (std::int64_t lane = 0; lane < lanes; ++lane) {
      look_at(lane, source.value(i + lane));
    }
  }
  for (; i < n; ++i) {
    look_at(0, source.value(i));
  }
  return {*std::min_element(smallest, smallest + lanes),
          *std::max_element(largest, largest + lanes)};
}

// Both kinds of lead never fall where the numbers rise. The lead of the smallest number is 0, that
// of the largest has its first bit set.
class EvenLead {
public:
  explicit EvenLead(const Range& range)
      : smallest_(range.smallest), scale_(double(std::numeric_limits<std::int32_t>::max()) /
                                          (range.largest - range.smallest)) {}
  // Not where the difference of two numbers overflows, nor where it is next to nothing.
  bool is_usable() const { return std::isfinite(scale_) && scale_ > 0; }
  std::uint32_t of_value(double value) const {
    return std::uint32_t(std::int32_t((value - smallest_) * scale_));
  }
  std::uint32_t of_key(std::uint64_t key) const { return of_value(value_of(key)); }

private:
  double smallest_;
  double scale_;
};

class FloatLead {
public:
  explicit FloatLead(const Range& range)
      : smallest_(key_of(range.smallest)),
        leading_zeros_(std::countl_zero((key_of(range.largest) - smallest_) | 1)) {}
  std::uint32_t of_value(double value) const { return of_key(key_of(value)); }
  std::uint32_t of_key(std::uint64_t key) const {
    return std::uint32_t((key - smallest_) << leading_zeros_ >> (64 - lead_bits));
  }

private:
  std::uint64_t smallest_;
  int leading_zeros_;
};

void exclusive_sums(std::uint32_t* counts, std::uint32_t size) {
  std::uint32_t sum = 0;
  for (std::uint32_t digit = 0; digit < size; ++digit) {
    const std::uint32_t count = counts[digit];
    counts[digit] = sum;
    sum += count;
  }
}

// Insertion sort of what is nearly in order; false where it is not and time is better spent
// otherwise.
bool repair_order(std::uint64_t* keys, std::int32_t* from, std::int64_t n) {
  constexpr std::int64_t moves_per_point = 4;
  std::int64_t moves_left = moves_per_point * n;
  for (std::int64_t i = 1; i < n; ++i) {
    if (keys[i - 1] <= keys[i]) {
      continue;
    }
    const std::uint64_t key = keys[i];
    const std::int32_t place = from[i];
    std::int64_t j = i;
    for (; j > 0 && keys[j - 1] > key; --j) {
      keys[j] = keys[j - 1];
      from[j] = from[j - 1];
    }
    keys[j] = key;
    from[j] = place;
    moves_left -= i - j;
    if (moves_left < 0) {
      return false;
    }
  }
  return true;
}

void comparison_sort(std::uint64_t* keys, std::int32_t* from, std::int64_t n,
                     std::vector<KsKeyedPlace>& items) {
  ks_grow(items, n);
  for (std::int64_t i = 0; i < n; ++i) {
    items[i] = {keys[i], from[i]};
  }
  std::sort(items.begin(), items.begin() + n, [](const KsKeyedPlace& a, const KsKeyedPlace& b) {
    return a.key != b.key ? a.key < b.key : a.from < b.from;
  });
  for (std::int64_t i = 0; i < n; ++i) {
    keys[i] = items[i].key;
    from[i] = items[i].from;
  }
}

class AxisSorter {
public:
  AxisSorter(KsSortScratch& scratch, KsSortedAxis& axis) : scratch_(scratch), axis_(axis) {}

  // Sort numbers into the axis.
  void sort(const double* values, std::int64_t n) {
    const Numbers numbers{values};
    with_lead(numbers, n, [&](const auto& lead) {
      if (n <= largest_part) {
        sort_part(numbers, 0, n, lead, lead_bits);
      } else {
        deal(numbers, 0, n, lead);
      }
    });
  }

private:
  // Call with the kind of lead that suits the numbers.
  template <class Source, class Call>
  static void with_lead(const Source& source, std::int64_t n, Call call) {
    const Range range = range_of(source, n);
    const EvenLead even(range);
    if (even.is_usable() && spreads(source, n, even)) {
      call(even);
    } else {
      call(FloatLead(range));
    }
  }

  // Whether no part would get many times its share of the numbers, judged by some of them.
  template <class Source, class Lead>
  static bool spreads(const Source& source, std::int64_t n, const Lead& lead) {
    constexpr std::int64_t looks = 128;
    constexpr int bits = 6;
    const std::int64_t step = n / looks + 1;
    std::uint32_t counts[1 << bits] = {};
    for (std::int64_t i = 0; i < n; i += step) {
      ++counts[source.lead(lead, i) >> (lead_bits - bits)];
    }
    return *std::max_element(std::begin(counts), std::end(counts)) <= n / step / 4;
  }

  template <class Source, class Lead>
  void deal(const Source& source, std::int64_t begin, std::int64_t n, const Lead& lead) {
    const int deal_bits = std::clamp(int(std::bit_width(std::uint64_t(n))) - part_bits,
                                     least_deal_bits, most_deal_bits);
    const int shift = lead_bits - deal_bits;
    std::uint32_t next[1 << most_deal_bits] = {};
    for (std::int64_t i = 0; i < n; ++i) {
      ++next[source.lead(lead, i) >> shift];
    }
    exclusive_sums(next, 1u << deal_bits);
    ks_grow(scratch_.dealt.key, begin + n); // what is dealt again has its room already
    ks_grow(scratch_.dealt.from, begin + n);
    std::uint64_t* const keys = scratch_.dealt.key.data() + begin;
    std::int32_t* const from = scratch_.dealt.from.data() + begin;
    for (std::int64_t i = 0; i < n; ++i) {
      const std::uint32_t to = next[source.lead(lead, i) >> shift]++;
      keys[to] = source.key(i);
      from[to] = source.from(i);
    }
    std::int64_t done = 0;
    for (std::uint32_t part = 0; part < 1u << deal_bits; ++part) {
      const std::int64_t size = next[part] - done;
      if (size <= largest_part) {
        sort_part(Part{keys + done, from + done}, begin + done, size, lead, shift);
      } else {
        std::copy_n(keys + done, size, axis_.key.data() + begin + done);
        std::copy_n(from + done, size, axis_.from.data() + begin + done);
        deal_again(begin + done, size);
      }
      done = next[part];
    }
  }

  // Deal what is in the axis already, on a scale of its own: the smallest and the largest number go
  // to different parts.
  void deal_again(std::int64_t begin, std::int64_t n) {
    const Part part{axis_.key.data() + begin, axis_.from.data() + begin};
    if (std::any_of(part.keys, part.keys + n,
                    [=](std::uint64_t key) { return key != part.keys[0]; })) {
      with_lead(part, n, [&](const auto& lead) { deal(part, begin, n, lead); });
    }
  }

  // `bits`: how many bits of the lead are left to tell the numbers apart.
  template <class Source, class Lead>
  void sort_part(const Source& source, std::int64_t begin, std::int64_t n, const Lead& lead,
                 int bits) {
    if (n <= short_digits_to) {
      radix_sort<short_digit>(source, n, lead, bits - 2 * short_digit);
    } else {
      radix_sort<long_digit>(source, n, lead, bits - 2 * long_digit);
    }
    std::uint64_t* const keys = axis_.key.data() + begin;
    std::int32_t* const from = axis_.from.data() + begin;
    for (std::int64_t i = 0; i < n; ++i) {
      const std::int32_t place = std::int32_t(scratch_.order[i]);
      keys[i] = source.key(place);
      from[i] = source.from(place);
    }
    if (repair_order(keys, from, n)) {
      return;
    }
    if (n > short_digits_to) {
      deal_again(begin, n);
    } else {
      comparison_sort(keys, from, n, scratch_.items);
    }
  }

  // Places in the order of two digits of the lead; `shift`: the bits of the lead that follow them.
  template <int digit_bits, class Source, class Lead>
  void radix_sort(const Source& source, std::int64_t n, const Lead& lead, int shift) {
    constexpr std::uint32_t digit_count = 1u << digit_bits;
    constexpr std::uint32_t mask = digit_count - 1;
    std::uint32_t low[digit_count] = {};
    std::uint32_t high[digit_count] = {};
    std::uint32_t* const leads = scratch_.leads.data();
    for (std::int64_t i = 0; i < n; ++i) {
      leads[i] = source.lead(lead, i) >> shift;
    }
    for (std::int64_t i = 0; i < n; ++i) {
      ++low[leads[i] & mask];
      ++high[leads[i] >> digit_bits & mask];
    }
    exclusive_sums(low, digit_count);
    exclusive_sums(high, digit_count);
    // Short items: what is written all over memory should stay in the inner caches.
    std::uint32_t* const order = scratch_.order.data();
    std::uint32_t* const middle = scratch_.middle.data();
    for (std::int64_t i = 0; i < n; ++i) {
      const std::uint32_t digits = leads[i];
      const std::uint32_t second = digits >> digit_bits & mask;
      middle[low[digits & mask]++] = second << place_bits | std::uint32_t(i);
    }
    constexpr std::uint32_t place_mask = (1u << place_bits) - 1;
    for (std::int64_t i = 0; i < n; ++i) {
      const std::uint32_t item = middle[i];
      order[high[item >> place_bits]++] = item & place_mask;
    }
  }

  KsSortScratch& scratch_;
  KsSortedAxis& axis_;
};

void sort_axis(const double* values, std::int64_t n, KsSortScratch& scratch, KsSortedAxis& axis) {
  ks_grow(axis.key, n);
  ks_grow(axis.from, n);
  if (n >= radix_from) {
    ks_grow(scratch.leads, std::min(n, largest_part));
    ks_grow(scratch.order, std::min(n, largest_part));
    ks_grow(scratch.middle, std::min(n, largest_part));
    AxisSorter(scratch, axis).sort(values, n);
  } else {
    for (std::int64_t i = 0; i < n; ++i) {
      axis.key[i] = key_of(values[i]);
      axis.from[i] = std::int32_t(i);
    }
    comparison_sort(axis.key.data(), axis.from.data(), n, scratch.items);
  }
  const auto end = axis.key.begin() + n;
  axis.tied = std::adjacent_find(axis.key.begin(), end) != end;
}

} // namespace

void ks_sort(const double* x, const double* y, std::int64_t n, KsSortScratch& scratch,
             KsSortedSample& sample) {
  sample.n = n;
  sort_axis(x, n, scratch, sample.x);
  ks_grow(scratch.y_by_x, n);
  for (std::int64_t rank = 0; rank < n; ++rank) {
    scratch.y_by_x[rank] = y[sample.x.from[rank]];
  }
  sort_axis(scratch.y_by_x.data(), n, scratch, sample.y);
}

} // namespace driftwalk
