// The KS statistic at the sizes where another way to sort or to count begins, for numbers that are
// hard to sort, on every instruction set.
#include "check.hpp"
#include "driftwalk/dispatch.hpp"
#include "driftwalk/stats/ks2d_kernel.hpp"
#include "environment.hpp"
#include "ks_samples.hpp"

#include <functional>
#include <numeric>

namespace {

void check_pair(const Sample& a, const Sample& b, KsTies ties, KsWorkspace& workspace) {
  const KsReference first(a.x.data(), a.y.data(), a.size());
  const KsReference second(b.x.data(), b.y.data(), b.size());
  const Differences expected = by_tree(a, b, ties);
  const KsResult r = ks_two_sample(first, b.x.data(), b.y.data(), b.size(), workspace, ties);
  CHECK(r.d1 == expected.d1 && r.d2 == expected.d2);
  const KsResult plain = ks_two_sample(a.x.data(), a.y.data(), a.size(), b.x.data(), b.y.data(),
                                       b.size(), workspace, ties);
  CHECK(plain.d1 == expected.d1 && plain.d2 == expected.d2 && plain.tied == r.tied);
  const std::int64_t half = r.tied / 2;
  const KsResult part = ks_two_sample(a.x.data(), a.y.data(), a.size(), b.x.data(), b.y.data(),
                                      b.size(), workspace, ties, half);
  CHECK(part.d1 == expected.d1 && part.tied <= r.tied && (part.tied > half) == (r.tied > half));
  const KsResult prepared = ks_two_sample(first, second, workspace, ties);
  CHECK(prepared.d1 == expected.d1 && prepared.d2 == expected.d2);
}

// The tree itself, by counting.
void check_the_tree() {
  std::mt19937_64 generator(11);
  for (const int levels : {0, 2}) {
    const Sample a = random_sample(generator, 30, levels);
    const Sample b = random_sample(generator, 40, levels);
    std::int64_t largest = 0;
    for (std::size_t o = 0; o < a.x.size(); ++o) {
      const auto count = [&](const Sample& s, int quadrant) {
        std::int64_t sum = 0;
        for (std::size_t i = 0; i < s.x.size(); ++i) {
          sum += ((quadrant & 1) != 0 ? s.x[i] > a.x[o] : s.x[i] < a.x[o]) &&
                 ((quadrant & 2) != 0 ? s.y[i] > a.y[o] : s.y[i] < a.y[o]);
        }
        return sum;
      };
      for (int quadrant = 0; quadrant < 4; ++quadrant) {
        largest = std::max<std::int64_t>(
            largest, std::abs(b.size() * count(a, quadrant) - a.size() * count(b, quadrant)));
      }
    }
    CHECK(by_tree(a, b, KsTies::strict).d1 == largest);
  }
}

void check_sizes() {
  std::mt19937_64 generator(12);
  KsWorkspace workspace;
  // A comparison or a radix sort; short or long digits; blocks of 128 or 256; one part or many.
  constexpr std::int64_t sizes[][2] = {{127, 129},       {128, 128},       {4'096, 4'097},
                                       {65'536, 65'535}, {65'536, 65'537}, {1, 131'071},
                                       {262'144, 50},    {262'145, 50}};
  for (const auto& size : sizes) {
    for (const int levels : {0, 300}) {
      const Sample a = random_sample(generator, size[0], levels);
      check_pair(a, random_sample(generator, size[1], levels),
                 levels > 0 ? KsTies::limits : KsTies::strict, workspace);
    }
  }
  // On a pixel grid, where the bounds serve.
  for (const std::int64_t n : {1'000, 20'000, 100'003}) {
    check_pair(random_sample(generator, n, 40), random_sample(generator, n + 1, 40), KsTies::strict,
               workspace);
  }
  // Equal to itself everywhere, so that no difference is there to be found.
  const Sample a = random_sample(generator, 3'000, 0);
  check_pair(a, a, KsTies::strict, workspace);
}

// Numbers that crowd in some of the leading bits by which they are sorted.
void check_crowded() {
  std::mt19937_64 generator(13);
  std::normal_distribution<double> normal;
  const std::function<double()> kinds[] = {
      [&] { return std::exp(100 * normal(generator)); },                         // over all sizes
      [&] { return 1 / normal(generator); },                                     // and signs
      [&] { return generator() % 1'000 == 0 ? 1e300 : normal(generator); },      // a few far ones
      [&] { return 1.0 + double(generator() % 100'000) * 0x1p-52; },             // close together
      [&] { return generator() % 3 == 0 ? -1e308 : 1e308 * normal(generator); }, // range overflows
      [&] { return double(generator() % 7) * 5e-324; },                          // next to zero
      [&] { return generator() % 2 == 0 ? 0.0 : -0.0; },                         // one number
      // Two clusters, each of many close numbers, and far from each other.
      [&] { return (generator() % 2 == 0 ? 1e9 : 1e-9) * (1 + 1e-12 * normal(generator)); },
  };
  KsWorkspace workspace;
  for (const std::int64_t n : {200, 5'000, 20'000, 270'000}) {
    for (const auto& kind : kinds) {
      Sample a;
      Sample b;
      for (std::int64_t i = 0; i < n; ++i) {
        a.x.push_back(std::clamp(kind(), -1e308, 1e308));
        a.y.push_back(normal(generator));
        if (i < n / 8) {
          b.x.push_back(std::clamp(kind(), -1e308, 1e308));
          b.y.push_back(normal(generator));
        }
      }
      check_pair(a, b, KsTies::strict, workspace);
      if (n <= 5'000) {
        std::swap(a.x, a.y);
        std::swap(b.x, b.y);
        check_pair(a, b, KsTies::limits, workspace);
      }
    }
  }
}

// The widest kernel serves samples larger than a test can wait for: here it counts a small one.
void check_widest_kernel() {
  std::mt19937_64 generator(14);
  for (const std::int64_t n : {2, 2'048, 9'000}) {
    Sample part[2];
    std::vector<std::int32_t> x_position(static_cast<std::size_t>(n));
    std::iota(x_position.begin(), x_position.end(), 0);
    std::shuffle(x_position.begin(), x_position.end(), generator);
    std::vector<std::uint8_t> second_by_x(x_position.size());
    std::vector<std::uint8_t> second_by_y(x_position.size());
    for (std::size_t y = 0; y < x_position.size(); ++y) {
      const bool is_second = y == 0 || (y != 1 && generator() % 3 == 0);
      second_by_y[y] = second_by_x[std::size_t(x_position[y])] = is_second;
      part[is_second].x.push_back(x_position[y]);
      part[is_second].y.push_back(double(y));
    }
    std::vector<char> scratch(static_cast<std::size_t>(ks_scratch_bytes(n)) + 64);
    KsSweep sweep{};
    sweep.n = n;
    sweep.x_position = x_position.data();
    sweep.second_by_x = second_by_x.data();
    sweep.second_by_y = second_by_y.data();
    sweep.weight[0] = part[1].size();
    sweep.weight[1] = -part[0].size();
    sweep.total = part[0].size() * part[1].size();
    sweep.scratch = scratch.data() + (64 - reinterpret_cast<std::uintptr_t>(scratch.data()) % 64);
    const Differences expected = by_tree(part[0], part[1], KsTies::strict);
    KsBest best[2];
    KsSweeper<std::int16_t, std::int32_t, std::int64_t, 11>(sweep).run(best);
    CHECK(best[0].value == expected.d1 && best[1].value == expected.d2);
    KsSweeper<std::int16_t, std::int32_t, std::int32_t, 11>(sweep).run(best);
    CHECK(best[0].value == expected.d1 && best[1].value == expected.d2);
  }
}

} // namespace

int main() {
  check_the_tree();
  check_widest_kernel();
  check_crowded();
  for (const InstructionSet set :
       {InstructionSet::baseline, InstructionSet::avx2, InstructionSet::avx512}) {
    if (!is_available(set)) {
      std::printf("%s: not available here\n", name(set));
      continue;
    }
    environment::choose_instruction_set(name(set));
    check_sizes();
    std::printf("%s: done\n", name(set));
  }
  return check::result();
}
