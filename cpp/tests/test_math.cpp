// Elementary functions of the float packs against double, over their whole stated domains.
#include "check.hpp"
#include "driftwalk/math/elementary.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

namespace {

using driftwalk::FloatPack;
using driftwalk::IntPack;
using driftwalk::UIntPack;
constexpr int lanes = 4;
using Real = FloatPack<lanes>;

float float_of_bits(std::uint32_t bits) {
  float value;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

// Distance from a float to a double in units of the last place of the double's float neighbour.
double ulps(float got, double exact) {
  const float near = std::fabs(static_cast<float>(exact));
  const double ulp = double(std::nextafter(near, INFINITY)) - double(near);
  return std::fabs(double(got) - exact) / ulp;
}

struct Worst {
  double log = 0, sine = 0, cosine = 0, absolute = 0;
};

void measure_log(const float* x, Worst& worst) {
  Real in;
  for (int k = 0; k < lanes; ++k) {
    in.set(k, x[k]);
  }
  const Real out = driftwalk::log(in);
  for (int k = 0; k < lanes; ++k) {
    worst.log = std::max(worst.log, ulps(out[k], std::log(double(x[k]))));
  }
}

void measure_sincos(const float* x, Worst& worst) {
  Real in, sine, cosine;
  for (int k = 0; k < lanes; ++k) {
    in.set(k, x[k]);
  }
  driftwalk::sincos(in, sine, cosine);
  for (int k = 0; k < lanes; ++k) {
    const double s = std::sin(double(x[k])), c = std::cos(double(x[k]));
    worst.sine = std::max(worst.sine, ulps(sine[k], s));
    worst.cosine = std::max(worst.cosine, ulps(cosine[k], c));
    worst.absolute = std::max({worst.absolute, std::fabs(sine[k] - s), std::fabs(cosine[k] - c)});
  }
}

// Every value that Box-Muller can ask for is k 2^-24, 1 <= k <= 2^24: a sieve of them, all of the
// first and last thousands, and floats of every binade in between.
void check_log() {
  Worst worst;
  std::vector<float> x;
  for (std::uint32_t k = 1; k <= 1u << 24; k += (k < 4096 || k > (1u << 24) - 4096) ? 1 : 29) {
    x.push_back(float(k) * 0x1p-24f);
  }
  for (std::uint32_t bits = 0x33800000u; bits <= 0x3f800000u; bits += 1009) {
    x.push_back(float_of_bits(bits));
  }
  x.resize(x.size() / lanes * lanes);
  for (std::size_t k = 0; k < x.size(); k += lanes) {
    measure_log(x.data() + k, worst);
  }
  std::printf("log: %.3f ulp over %zu values\n", worst.log, x.size());
  CHECK(worst.log < 1.0);
  Real one{1.0f};
  CHECK(driftwalk::log(one)[0] == 0.0f);
}

// Powers of the speed need the logarithm of more than that, and the exponential of it.
void check_wide_log() {
  Worst worst;
  for (std::uint32_t bits = 0x00800000u; bits <= 0x7f000000u; bits += 4 * 3001) {
    float x[lanes];
    for (int k = 0; k < lanes; ++k) {
      x[k] = float_of_bits(bits + 3001u * std::uint32_t(k));
    }
    measure_log(x, worst);
  }
  std::printf("log of all floats: %.3f ulp\n", worst.log);
  CHECK(worst.log < 1.0);
}

void check_exp() {
  double worst = 0;
  std::size_t count = 0;
  for (double x = -87; x <= 88; x += 1.3e-4, ++count) {
    const float value = static_cast<float>(x);
    worst = std::max(worst, ulps(driftwalk::exp(Real(value))[0], std::exp(double(value))));
  }
  std::printf("exp: %.3f ulp over %zu values\n", worst, count);
  CHECK(worst < 1.0);
}

void check_sincos() {
  Worst worst;
  std::vector<float> x;
  for (std::uint32_t bits = 0; bits <= 0x41000000u; bits += 1201) {
    x.push_back(float_of_bits(bits));
    x.push_back(-float_of_bits(bits));
  }
  // The hard places: next to the multiples of pi / 4, where quadrants change and zeros lie.
  for (int quarter = -10; quarter <= 10; ++quarter) {
    float at = static_cast<float>(quarter * (driftwalk::pi_value / 4));
    for (int k = 0; k < 2000; ++k) {
      at = std::nextafter(at, -100.0f);
    }
    for (int k = 0; k < 4000; ++k) {
      if (std::fabs(at) <= 8.0f) {
        x.push_back(at);
      }
      at = std::nextafter(at, 100.0f);
    }
  }
  x.resize(x.size() / lanes * lanes);
  for (std::size_t k = 0; k < x.size(); k += lanes) {
    measure_sincos(x.data() + k, worst);
  }
  std::printf("sine: %.3f ulp, cosine: %.3f ulp, %.3g absolute, over %zu values\n", worst.sine,
              worst.cosine, worst.absolute, x.size());
  CHECK(worst.sine < 2.0);
  CHECK(worst.cosine < 2.0);
  CHECK(worst.absolute < 1e-7);
}

// Distance of doubles in units of the last place, against the widest numbers of the machine.
double double_ulps(double got, long double exact) {
  const double near = std::fabs(static_cast<double>(exact));
  const double ulp = std::nextafter(near, INFINITY) - near;
  return static_cast<double>(std::fabs(got - exact)) / ulp;
}

void check_doubles() {
  double worst_log = 0, worst_exp = 0, worst_sine = 0, worst_cosine = 0;
  for (int k = 1; k <= 1000000; ++k) {
    const double share = k * 1e-6, angle = 17.3 * (share - 0.5), power = 140 * (share - 0.5);
    const double wide = std::exp2(1900 * (share - 0.5));
    double sine = 0, cosine = 0;
    driftwalk::sincos(angle, sine, cosine);
    for (const double x : {share, 1 + share, wide}) {
      worst_log = std::max(worst_log, double_ulps(driftwalk::log(x), std::log((long double)x)));
    }
    worst_exp =
        std::max(worst_exp, double_ulps(driftwalk::exp(power), std::exp((long double)power)));
    worst_sine = std::max(worst_sine, double_ulps(sine, std::sin((long double)angle)));
    worst_cosine = std::max(worst_cosine, double_ulps(cosine, std::cos((long double)angle)));
  }
  std::printf("double: log %.3f, exp %.3f, sine %.3f, cosine %.3f ulp\n", worst_log, worst_exp,
              worst_sine, worst_cosine);
  CHECK(std::max({worst_log, worst_exp, worst_sine, worst_cosine}) <= 1.0);
  double sine = 0, cosine = 0;
  driftwalk::sincos(1e300, sine, cosine);
  CHECK(sine == std::sin(1e300) && cosine == std::cos(1e300));
  CHECK(std::isnan(driftwalk::log(NAN)) && std::isnan(driftwalk::exp(NAN)));
  CHECK(driftwalk::log(0.0) == -INFINITY && driftwalk::exp(-1000.0) == 0.0);
}

bool same_bits(double a, double b) {
  return std::memcmp(&a, &b, sizeof a) == 0 || (std::isnan(a) && std::isnan(b));
}

// Every function of a pack of doubles against that of one, far beyond what the kernels ask too.
template <int N>
void check_double_packs() {
  using Pack = driftwalk::DoublePack<N>;
  const double far[] = {0.0, -0.0, 1e300, -1e300, INFINITY, NAN, 1e5, -1e-310, 700, -701};
  std::uint64_t word = 1;
  const auto any = [&] {
    word = word * 6364136223846793005u + 1442695040888963407u;
    const double share = double(word >> 11) * 0x1p-53;
    return word % 97 == 0 ? far[word / 97 % std::size(far)] : 17.3 * (share - 0.5);
  };
  for (int k = 0; k < 20000; ++k) {
    Pack x, y, sine, cosine;
    for (int lane = 0; lane < N; ++lane) {
      x.set(lane, any());
      y.set(lane, any());
    }
    driftwalk::sincos(x, sine, cosine);
    const Pack log = driftwalk::log(x), exp = driftwalk::exp(x), root = driftwalk::sqrt(x);
    const Pack most = driftwalk::max(x, y), least = driftwalk::min(x, y);
    const Pack size = driftwalk::abs(x), with_sign = driftwalk::copy_sign(x, y);
    const Pack near = driftwalk::clamp_to(x, -1e4, 1e4);
    const Pack whole = driftwalk::to_real(near, driftwalk::truncate(near));
    for (int lane = 0; lane < N; ++lane) {
      const double a = x[lane], b = y[lane];
      double s, c;
      driftwalk::sincos(a, s, c);
      CHECK(same_bits(sine[lane], s) && same_bits(cosine[lane], c));
      CHECK(same_bits(log[lane], driftwalk::log(a)) && same_bits(exp[lane], driftwalk::exp(a)));
      CHECK(same_bits(root[lane], driftwalk::sqrt(a)));
      CHECK(same_bits(most[lane], driftwalk::max(a, b)));
      CHECK(same_bits(least[lane], driftwalk::min(a, b)));
      CHECK(same_bits(size[lane], driftwalk::abs(a)));
      CHECK(same_bits(with_sign[lane], driftwalk::copy_sign(a, b)));
      CHECK(whole[lane] == std::trunc(driftwalk::clamp_to(a, -1e4, 1e4)));
      CHECK(same_bits(Pack(a)[lane], a));
    }
  }
}

// Packs against the plain rule, at equal, unordered and signed-zero operands.
void check_select_rules() {
  const float values[] = {0.0f, -0.0f, 1.0f, -1.0f, NAN, INFINITY, -INFINITY, 3.5f};
  for (const float a : values) {
    for (const float b : values) {
      const float most = a > b ? a : b, least = a < b ? a : b;
      Real first, second; // lane by lane: the broadcast 0 + value has no negative zero
      for (int lane = 0; lane < lanes; ++lane) {
        first.set(lane, a);
        second.set(lane, b);
      }
      const float got_most = driftwalk::max(first, second)[0];
      const float got_least = driftwalk::min(first, second)[0];
      CHECK(std::memcmp(&most, &got_most, sizeof most) == 0);
      CHECK(std::memcmp(&least, &got_least, sizeof least) == 0);
    }
  }
  // A clamp turns NaN into a bound, so that no table is ever read at a NaN.
  CHECK(driftwalk::bounded_angle(Real(NAN))[0] == -8.0f);
  CHECK(driftwalk::bounded_angle(double(NAN)) == -8.0);
  CHECK(driftwalk::bounded_angle(Real(INFINITY))[2] == 8.0f);
  Real mixed{0.0f};
  mixed.set(3, 1.0f);
  CHECK(driftwalk::any(mixed > 0.5f) && !driftwalk::any(mixed > 1.5f));
}

void check_wrap_angle() {
  const double pi = driftwalk::pi_value;
  for (int k = -200; k <= 200; ++k) {
    const double angle = k * (2 * pi / 200);
    const double wrapped = driftwalk::wrap_angle(angle);
    CHECK(std::fabs(wrapped) <= pi);
    CHECK_NEAR(std::remainder(wrapped - angle, 2 * pi), 0.0, 1e-14);
    const float single = driftwalk::wrap_angle(Real(static_cast<float>(angle)))[1];
    CHECK(std::fabs(single) <= 3.1415928f);
    CHECK_NEAR(std::remainder(double(single) - angle, 2 * pi), 0.0, 1e-6);
  }
}

void check_wide_products() {
  std::uint32_t word = 1;
  for (int k = 0; k < 2000; ++k) {
    word = word * 747796405u + 2891336453u;
    const std::uint32_t factor = k % 3 == 0 ? 0xffffffffu : word ^ 0x9E3779B9u;
    UIntPack<lanes> b;
    for (int lane = 0; lane < lanes; ++lane) {
      b.set(lane, k == 7 ? 0xffffffffu : word + 0x10001u * std::uint32_t(lane));
    }
    UIntPack<lanes> high, low;
    driftwalk::multiply_wide(factor, b, high, low);
    for (int lane = 0; lane < lanes; ++lane) {
      const std::uint64_t product = std::uint64_t(factor) * b[lane];
      CHECK(high[lane] == product >> 32 && low[lane] == (product & 0xffffffffu));
    }
  }
}

} // namespace

int main() {
  check_log();
  check_wide_log();
  check_exp();
  check_sincos();
  check_doubles();
  check_double_packs<2>();
  check_double_packs<4>();
  check_double_packs<8>();
  check_select_rules();
  check_wrap_angle();
  check_wide_products();
  return check::result();
}
