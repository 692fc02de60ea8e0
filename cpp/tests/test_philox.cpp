// Philox 4x32-10 against the known answers of Random123 (Salmon et al., file kat_vectors), and the
// normal numbers made from it against the normal distribution.
#include "check.hpp"
#include "driftwalk/random/normal.hpp"
#include "driftwalk/random/philox.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace {

using driftwalk::FloatPack;
using driftwalk::Philox;
using driftwalk::UIntPack;

struct Known {
  std::uint32_t counter[4], key[2], words[4];
};

const Known known_answers[] = {
    {{0, 0, 0, 0}, {0, 0}, {0x6627e8d5u, 0xe169c58du, 0xbc57ac4cu, 0x9b00dbd8u}},
    {{0xffffffffu, 0xffffffffu, 0xffffffffu, 0xffffffffu},
     {0xffffffffu, 0xffffffffu},
     {0x408f276du, 0x41c83b0eu, 0xa20bc7c6u, 0x6d5451fdu}},
    {{0x243f6a88u, 0x85a308d3u, 0x13198a2eu, 0x03707344u},
     {0xa4093822u, 0x299f31d0u},
     {0xd16cfe09u, 0x94fdccebu, 0x5001e420u, 0x24126ea1u}},
};

template <class UInt>
void words_at(const Known& known, UInt* out) {
  const Philox<UInt> stream{UInt(known.key[0]), UInt(known.key[1])};
  stream(UInt(known.counter[0]), UInt(known.counter[1]), UInt(known.counter[2]),
         UInt(known.counter[3]), out);
}

template <int N>
void check_pack(const Known& known) {
  UIntPack<N> packed[4];
  words_at(known, packed);
  for (int word = 0; word < 4; ++word) {
    for (int lane = 0; lane < N; ++lane) {
      CHECK(packed[word][lane] == known.words[word]);
    }
  }
}

void check_known_answers() {
  for (const Known& known : known_answers) {
    std::uint32_t words[4];
    words_at(known, words);
    for (int word = 0; word < 4; ++word) {
      CHECK(words[word] == known.words[word]);
    }
    check_pack<4>(known);
    check_pack<8>(known);
    check_pack<16>(known);
  }
}

// Lanes with keys of their own do not mix.
void check_lanes_are_independent() {
  UIntPack<4> low{0u}, high{0u}, packed[4];
  for (int lane = 0; lane < 4; ++lane) {
    low.set(lane, 17u * std::uint32_t(lane));
    high.set(lane, ~std::uint32_t(lane));
  }
  const Philox<UIntPack<4>> stream{low, high};
  stream(UIntPack<4>(5u), UIntPack<4>(0u), UIntPack<4>(1u), UIntPack<4>(2u), packed);
  for (int lane = 0; lane < 4; ++lane) {
    std::uint32_t words[4];
    Philox<std::uint32_t>{low[lane], high[lane]}(5u, 0u, 1u, 2u, words);
    for (int word = 0; word < 4; ++word) {
      CHECK(packed[word][lane] == words[word]);
    }
  }
}

double normal_cdf(double x) {
  return 0.5 * std::erfc(-x * 0.70710678118654752440);
}

// Moments within 6 standard errors (false alarm 2e-9 each) and the KS distance to the normal
// distribution below its 1e-6 quantile, sqrt(-ln(1e-6 / 2) / 2 / n).
void check_distribution(std::vector<double> sample, const char* name) {
  const double n = double(sample.size());
  double mean = 0, square = 0, cube = 0, fourth = 0;
  for (const double x : sample) {
    mean += x;
    square += x * x;
    cube += x * x * x;
    fourth += x * x * x * x;
  }
  CHECK_NEAR(mean / n, 0.0, 6 / std::sqrt(n));
  CHECK_NEAR(square / n, 1.0, 6 * std::sqrt(2 / n));
  CHECK_NEAR(cube / n, 0.0, 6 * std::sqrt(15 / n));
  CHECK_NEAR(fourth / n, 3.0, 6 * std::sqrt(96 / n));
  std::sort(sample.begin(), sample.end());
  double distance = 0;
  for (std::size_t k = 0; k < sample.size(); ++k) {
    const double cdf = normal_cdf(sample[k]);
    distance = std::max({distance, cdf - double(k) / n, double(k + 1) / n - cdf});
  }
  std::printf("%s: KS distance %.5f of %.5f\n", name, distance, 2.6934 / std::sqrt(n));
  CHECK(distance < 2.6934 / std::sqrt(n));
  CHECK(std::fabs(sample.front()) < 5.78 && sample.back() < 5.78);
}

void check_normals() {
  constexpr int blocks = 1 << 16;
  std::vector<double> first, second, single;
  double difference = 0, product = 0;
  for (std::uint32_t k = 0; k < blocks; ++k) {
    std::uint32_t words[4];
    Philox<std::uint32_t>{0xdeadbeefu, 42u}(k, 0u, 0u, 1u, words);
    double a, b;
    driftwalk::normal_pair(words[0], words[1], a, b);
    FloatPack<4> c, d;
    driftwalk::normal_pair(UIntPack<4>(words[0]), UIntPack<4>(words[1]), c, d);
    difference = std::max({difference, std::fabs(a - c[0]), std::fabs(b - d[3])});
    first.push_back(a);
    second.push_back(b);
    single.push_back(c[1]);
    single.push_back(d[2]);
    product += a * b;
  }
  std::printf("float against double normals: %.3g\n", difference);
  CHECK(difference < 2e-6);
  CHECK_NEAR(product / blocks, 0.0, 6 / std::sqrt(double(blocks)));
  check_distribution(first, "first of a pair");
  check_distribution(second, "second of a pair");
  check_distribution(single, "float packs");
}

// The ends of the words: the largest radius, the smallest, and the quadrants' borders.
void check_extreme_words() {
  for (const std::uint32_t word0 : {0u, 255u, 256u, 0x7fffffffu, 0xffffffffu}) {
    for (const std::uint32_t word1 : {0u, 0x3fffffffu, 0x40000000u, 0x80000000u, 0xffffffffu}) {
      double a, b;
      driftwalk::normal_pair(word0, word1, a, b);
      FloatPack<4> c, d;
      driftwalk::normal_pair(UIntPack<4>(word0), UIntPack<4>(word1), c, d);
      CHECK(std::isfinite(a) && std::isfinite(b) && std::hypot(a, b) < 5.77);
      CHECK_NEAR(double(c[0]), a, 2e-6);
      CHECK_NEAR(double(d[0]), b, 2e-6);
    }
  }
}

} // namespace

int main() {
  check_known_answers();
  check_lanes_are_independent();
  check_normals();
  check_extreme_words();
  return check::result();
}
