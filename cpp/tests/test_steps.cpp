// Steps by hand, and the arc tangent against the long double of the C library.
#include "check.hpp"
#include "driftwalk/math/atan2.hpp"
#include "driftwalk/stats/steps.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace {

using driftwalk::apply_step_plan;
using driftwalk::StepPlanView;

constexpr double pi = 3.14159265358979323846;

void check_atan2() {
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::uniform_real_distribution<double> exponent(-40.0, 40.0);
  double worst = 0;
  for (int i = 0; i < 200000; ++i) {
    const double y = unit(generator) * std::exp2(i % 2 == 0 ? 0.0 : exponent(generator));
    const double x = unit(generator) * std::exp2(i % 2 == 0 ? 0.0 : exponent(generator));
    const long double exact = std::atan2(static_cast<long double>(y), static_cast<long double>(x));
    const double near = std::fabs(double(exact));
    const double ulp = std::nextafter(near, 10.0) - near;
    worst = std::max(worst, double(std::fabs(driftwalk::atan2(y, x) - exact)) / ulp);
  }
  CHECK(worst < 3.0);
  for (const double y : {0.0, -0.0, 1.0, -1.0}) {
    for (const double x : {0.0, -0.0, 1.0, -1.0}) {
      CHECK(driftwalk::atan2(y, x) == std::atan2(y, x));
      CHECK(std::signbit(driftwalk::atan2(y, x)) == std::signbit(std::atan2(y, x)));
    }
  }
}

// East, then north, then west, back east (a half turn), nothing, north.
template <class T>
void check_by_hand() {
  const std::vector<T> x = {0, 2, 2, 1, 3, 3, 3};
  const std::vector<T> y = {0, 0, 3, 3, 3, 3, 4};
  const std::vector<std::int32_t> left = {0, 1, 2, 3, 4, 5, 6};
  const std::vector<double> weight(7, 0.0);
  const std::vector<std::int32_t> triple = {0, 1, 2, 3, 4};
  const StepPlanView plan{left.data(), weight.data(), triple.data(), 7, 5};
  std::vector<double> length(5, -1.0);
  std::vector<double> angle(5, -9.0);
  std::vector<std::int32_t> kept(5, -1);
  std::int64_t zero = -1;
  std::int64_t missing = -1;
  const std::int64_t written = apply_step_plan(plan, x.data(), y.data(), length.data(),
                                               angle.data(), &zero, &missing, kept.data());
  CHECK(written == 3 && zero == 2 && missing == 0);
  CHECK(length[0] == 3.0 && length[1] == 1.0 && length[2] == 2.0);
  CHECK_NEAR(angle[0], pi / 2, 1e-15);
  CHECK_NEAR(angle[1], pi / 2, 1e-15);
  CHECK(angle[2] == pi);
  CHECK(kept[0] == 0 && kept[1] == 1 && kept[2] == 2);
}

void check_interpolation_and_missing() {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<double> x = {0.0, 4.0, 4.0, 4.0, nan};
  const std::vector<double> y = {0.0, 0.0, 2.0, 9.0, 0.0};
  // (1, 0), (4, 0), (4, 1) and the last sample, whose right neighbour does not exist.
  const std::vector<std::int32_t> left = {0, 1, 1, 4};
  const std::vector<double> weight = {0.25, 0.0, 0.5, 0.0};
  const std::vector<std::int32_t> triple = {0, 1};
  const StepPlanView plan{left.data(), weight.data(), triple.data(), 4, 2};
  double length[2];
  double angle[2];
  std::int64_t zero = -1;
  std::int64_t missing = -1;
  const std::int64_t written =
      apply_step_plan(plan, x.data(), y.data(), length, angle, &zero, &missing);
  CHECK(written == 1 && zero == 0 && missing == 1);
  CHECK(length[0] == 1.0);
  CHECK_NEAR(angle[0], pi / 2, 1e-15);
}

} // namespace

int main() {
  check_atan2();
  check_by_hand<double>();
  check_by_hand<float>();
  check_interpolation_and_missing();
  return check::result();
}
