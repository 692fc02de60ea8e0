// The KS statistic against its definition, on every instruction set, with and without ties.
#include "check.hpp"
#include "driftwalk/dispatch.hpp"
#include "driftwalk/stats/ks2d_permutation.hpp"
#include "environment.hpp"
#include "ks_samples.hpp"

namespace {

std::int64_t inside(const Sample& s, double x, double y, int quadrant, bool in_x, bool in_y) {
  std::int64_t count = 0;
  for (std::size_t i = 0; i < s.x.size(); ++i) {
    const bool across = (quadrant & 1) != 0 ? s.x[i] > x : s.x[i] < x;
    const bool along = (quadrant & 2) != 0 ? s.y[i] > y : s.y[i] < y;
    count += (across || (in_x && s.x[i] == x)) && (along || (in_y && s.y[i] == y));
  }
  return count;
}

// The definition, word for word.
std::int64_t by_definition(const Sample& origins, const Sample& a, const Sample& b, KsTies ties) {
  std::int64_t largest = 0;
  for (std::size_t o = 0; o < origins.x.size(); ++o) {
    for (int quadrant = 0; quadrant < 4; ++quadrant) {
      for (int closed = 0; closed < (ties == KsTies::limits ? 4 : 1); ++closed) {
        const bool in_x = (closed & 1) != 0;
        const bool in_y = (closed & 2) != 0;
        const std::int64_t c1 = inside(a, origins.x[o], origins.y[o], quadrant, in_x, in_y);
        const std::int64_t c2 = inside(b, origins.x[o], origins.y[o], quadrant, in_x, in_y);
        largest = std::max(largest, std::abs(b.size() * c1 - a.size() * c2));
      }
    }
  }
  return largest;
}

std::int64_t every_cut(const Sample& a, const Sample& b) {
  std::int64_t largest = 0;
  Values xs = a.x;
  Values ys = a.y;
  xs.insert(xs.end(), b.x.begin(), b.x.end());
  ys.insert(ys.end(), b.y.begin(), b.y.end());
  for (const double x : xs) {
    for (const double y : ys) {
      for (int quadrant = 0; quadrant < 4; ++quadrant) {
        const bool in_x = (quadrant & 1) == 0; // {x <= X} against {x > X}
        const bool in_y = (quadrant & 2) == 0;
        const std::int64_t c1 = inside(a, x, y, quadrant, in_x, in_y);
        const std::int64_t c2 = inside(b, x, y, quadrant, in_x, in_y);
        largest = std::max(largest, std::abs(b.size() * c1 - a.size() * c2));
      }
    }
  }
  return largest;
}

void check_place(const KsResult& r, const Sample& a, const Sample& b) {
  if (r.d1 > 0) {
    const std::int64_t c1 = inside(a, r.place1.x, r.place1.y, r.place1.quadrant, false, false);
    const std::int64_t c2 = inside(b, r.place1.x, r.place1.y, r.place1.quadrant, false, false);
    CHECK(std::abs(r.n2 * c1 - r.n1 * c2) == r.d1);
    CHECK(a.x[r.place1.index] == r.place1.x && a.y[r.place1.index] == r.place1.y);
  } else {
    CHECK(r.place1.quadrant == -1);
  }
  if (r.d2 > 0) {
    CHECK(b.x[r.place2.index] == r.place2.x && b.y[r.place2.index] == r.place2.y);
  }
}

void compare_with_definition() {
  std::mt19937_64 generator(20260101);
  KsWorkspace workspace;
  for (int round = 0; round < 300; ++round) {
    const std::uint64_t largest = round % 20 == 0 ? 400 : 40;
    const int levels = round % 4 == 0 ? 0 : 1 + int(generator() % 8);
    const Sample a = random_sample(generator, 1 + std::int64_t(generator() % largest), levels);
    Sample b = random_sample(generator, 1 + std::int64_t(generator() % largest), levels);
    if (round % 7 == 0) {
      std::fill(b.x.begin(), b.x.end(), a.x[0]); // a constant column
    }
    const KsReference reference(a.x.data(), a.y.data(), a.size());
    for (const KsTies ties : {KsTies::strict, KsTies::limits}) {
      const KsResult r =
          ks_two_sample(reference, b.x.data(), b.y.data(), b.size(), workspace, ties);
      CHECK(r.d1 == by_definition(a, a, b, ties));
      CHECK(r.d2 == by_definition(b, a, b, ties));
      if (ties == KsTies::strict) {
        check_place(r, a, b);
      }
    }
    if (largest == 40) {
      const KsPeacock cut = ks_peacock(reference, b.x.data(), b.y.data(), b.size(), workspace);
      CHECK(cut.d == every_cut(a, b));
    }
  }
}

// What the whole result must be: the largest difference and, of origins that reach it, the first in
// the order of x, then the highest, then the last of its sample.
struct Expected {
  std::int64_t value = 0;
  std::int64_t row = -1;
  int quadrant = -1;
};
Expected by_every_origin(const Sample& origins, const Sample& a, const Sample& b) {
  Expected best;
  for (std::size_t o = 0; o < origins.x.size(); ++o) {
    for (int quadrant = 0; quadrant < 4; ++quadrant) {
      const std::int64_t c1 = inside(a, origins.x[o], origins.y[o], quadrant, false, false);
      const std::int64_t c2 = inside(b, origins.x[o], origins.y[o], quadrant, false, false);
      const std::int64_t value = std::abs(b.size() * c1 - a.size() * c2);
      const std::size_t other = best.row < 0 ? o : std::size_t(best.row);
      const bool first = origins.x[o] != origins.x[other]   ? origins.x[o] < origins.x[other]
                         : origins.y[o] != origins.y[other] ? origins.y[o] > origins.y[other]
                                                            : o > other;
      if (value > best.value || (value == best.value && value > 0 && first)) {
        best = {value, std::int64_t(o), quadrant};
      }
    }
  }
  return best;
}

std::int64_t count_tied(const Sample& a, const Sample& b) {
  Sample all = a;
  all.x.insert(all.x.end(), b.x.begin(), b.x.end());
  all.y.insert(all.y.end(), b.y.begin(), b.y.end());
  std::int64_t tied = 0;
  for (std::size_t i = 0; i < all.x.size(); ++i) {
    bool is_tied = false;
    for (std::size_t j = 0; j < all.x.size() && !is_tied; ++j) {
      is_tied = i != j && (all.x[i] == all.x[j] || all.y[i] == all.y[j]);
    }
    tied += is_tied;
  }
  return tied;
}

void check_whole_result(const KsResult& r, const Sample& a, const Sample& b) {
  const Expected first = by_every_origin(a, a, b);
  const Expected second = by_every_origin(b, a, b);
  CHECK(r.d1 == first.value && r.d2 == second.value);
  CHECK(r.place1.index == first.row && r.place1.quadrant == first.quadrant);
  CHECK(r.place2.index == second.row && r.place2.quadrant == second.quadrant);
  CHECK(r.tied == count_tied(a, b));
}

// Samples large enough for bounds, with numbers that are hard to cut into buckets: those of a pixel
// grid, the same but for rounding, far outliers, one column, samples that share most points.
void compare_bounds_with_definition() {
  std::mt19937_64 generator(20260102);
  KsWorkspace workspace;
  for (int kind = 0; kind < 9; ++kind) {
    const int levels = kind == 1 ? 2 : kind == 2 || kind == 3 ? 9 : kind == 4 ? 200 : 0;
    Sample a = random_sample(generator, 560 + std::int64_t(generator() % 40), levels);
    Sample b = random_sample(generator, kind == 6 ? 30 + a.size() : 600, levels);
    for (double& x : b.x) {
      x += kind % 2 == 1 ? 1.0 : 0.0;
    }
    if (kind == 3) {
      for (Values* values : {&a.x, &b.x, &a.y, &b.y}) {
        for (double& value : *values) {
          value += 0x1p-52 * double(generator() % 16);
        }
      }
    }
    if (kind == 5) {
      a.x[7] = 1e300;
      b.y[9] = -1e300;
      std::fill_n(b.y.begin() + 100, 200, 0.25);
    }
    if (kind == 6) { // all but the last points
      std::copy(a.x.begin(), a.x.end(), b.x.begin());
      std::copy(a.y.begin(), a.y.end(), b.y.begin());
    }
    if (kind == 7) {
      std::fill(a.x.begin(), a.x.end(), -0.0);
      std::fill(b.x.begin(), b.x.end(), 0.0);
    }
    if (kind == 8) {
      std::fill(a.y.begin(), a.y.end(), 2.0);
      std::fill(b.y.begin(), b.y.begin() + 300, 2.0);
    }
    const KsReference first(a.x.data(), a.y.data(), a.size());
    const KsReference second(b.x.data(), b.y.data(), b.size());
    check_whole_result(ks_two_sample(a.x.data(), a.y.data(), a.size(), b.x.data(), b.y.data(),
                                     b.size(), workspace),
                       a, b);
    check_whole_result(ks_two_sample(first, b.x.data(), b.y.data(), b.size(), workspace), a, b);
    check_whole_result(ks_two_sample(first, second, workspace), a, b);
  }
}

// Beyond 65,536 points positions need 32 bits; sizes without a common factor need wide weights.
void compare_wide_with_narrow() {
  std::mt19937_64 generator(7);
  const Sample a = random_sample(generator, 700, 0);
  const Sample b = random_sample(generator, 600, 0);
  KsWorkspace workspace;
  const KsReference reference(a.x.data(), a.y.data(), a.size());
  const KsResult once = ks_two_sample(reference, b.x.data(), b.y.data(), b.size(), workspace);
  for (const int copies : {60, 130}) { // every point as a group of identical points: D is unchanged
    Sample many;
    for (int c = 0; c < copies; ++c) {
      many.x.insert(many.x.end(), b.x.begin(), b.x.end());
      many.y.insert(many.y.end(), b.y.begin(), b.y.end());
    }
    const KsResult r =
        ks_two_sample(reference, many.x.data(), many.y.data(), many.size(), workspace);
    CHECK(r.d1 == once.d1 * copies);
    CHECK(r.d2 == once.d2 * copies);
  }
}

void check_permutations() {
  std::mt19937_64 generator(3);
  const Sample pooled = random_sample(generator, 90, 4);
  const std::int64_t n1 = 40;
  std::vector<std::int32_t> block_of;
  for (int i = 0; i < 90; ++i) {
    block_of.push_back(i / 10);
  }
  const std::vector<std::uint8_t> labels = {0, 0, 0, 0, 1, 1, 1, 1, 1, //
                                            1, 0, 1, 0, 1, 0, 1, 0, 1};
  std::vector<std::int64_t> statistic(2);
  ks_permutations(pooled.x.data(), pooled.y.data(), n1, 50, block_of.data(), 9, labels.data(), 2,
                  KsTies::strict, statistic.data());
  for (std::size_t p = 0; p < 2; ++p) {
    Sample part[2];
    for (std::size_t i = 0; i < 90; ++i) {
      Sample& own = part[labels[p * 9 + std::size_t(block_of[i])]];
      own.x.push_back(pooled.x[i]);
      own.y.push_back(pooled.y[i]);
    }
    CHECK(statistic[p] == by_definition(part[0], part[0], part[1], KsTies::strict) +
                              by_definition(part[1], part[0], part[1], KsTies::strict));
  }
}

void check_edges() {
  KsWorkspace workspace;
  const double zero = 0.0;
  const double minus_zero = -0.0;
  const double one = 1.0;
  const KsReference reference(&zero, &zero, 1);
  const KsResult same = ks_two_sample(reference, &minus_zero, &minus_zero, 1, workspace);
  CHECK(same.d1 == 0 && same.d2 == 0 && same.distance() == 0.0 && same.tied == 2);
  const KsResult apart = ks_two_sample(reference, &one, &one, 1, workspace);
  CHECK(apart.d1 == 1 && apart.d2 == 1 && apart.distance() == 1.0);
  CHECK(apart.place().quadrant == 3 && apart.place().x == 0.0);
  CHECK(std::isnan(ks_two_sample(reference, &one, &one, 0, workspace).distance()));
  const double bad[2] = {1.0, std::nan("")};
  CHECK(first_not_finite(bad, bad, 2) == 1 && first_not_finite(bad, bad, 1) == -1);
  // Keys that agree in their leading bits: the radix sort alone would leave them unsorted.
  Sample near;
  std::mt19937_64 generator(5);
  for (int i = 0; i < 3000; ++i) {
    near.x.push_back(i == 0 ? 1e300 : 1.0 + double(generator() % 4096) * 0x1p-52);
    near.y.push_back(double(generator() % 4096));
  }
  const KsReference clustered(near.x.data(), near.y.data(), 3000);
  Sample shuffled = near;
  std::reverse(shuffled.x.begin(), shuffled.x.end());
  std::reverse(shuffled.y.begin(), shuffled.y.end());
  CHECK(ks_two_sample(clustered, shuffled.x.data(), shuffled.y.data(), 3000, workspace).d1 == 0);
}

} // namespace

int main() {
  for (const InstructionSet set :
       {InstructionSet::baseline, InstructionSet::avx2, InstructionSet::avx512}) {
    if (!is_available(set)) {
      std::printf("%s: not available here\n", name(set));
      continue;
    }
    environment::choose_instruction_set(name(set));
    compare_with_definition();
    compare_bounds_with_definition();
    compare_wide_with_narrow();
    check_permutations();
    check_edges();
    std::printf("%s: done\n", name(set));
  }
  return check::result();
}
