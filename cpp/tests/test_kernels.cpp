// All kernels in one program, as in the Python module, on every instruction set. A name that two of
// their files define differently is kept once by the linker, and the others then run what is not
// theirs; the programs with one kernel alone cannot mix anything up.
#include "check.hpp"
#include "driftwalk/dispatch.hpp"
#include "driftwalk/infer/innovations.hpp"
#include "driftwalk/stats/ks2d.hpp"
#include "environment.hpp"
#include "synthetic_assembly.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <vector>

namespace {

using driftwalk::InstructionSet;
using synthetic::Tank;

// Everything that the kernels gave, as plain numbers.
using Numbers = std::vector<double>;

template <class T>
void append(Numbers& all, const std::vector<T>& values) {
  all.insert(all.end(), values.begin(), values.end());
}

template <class T>
double farthest(const std::vector<T>& a, const std::vector<double>& b) {
  double most = a.size() == b.size() ? 0 : INFINITY;
  for (std::size_t k = 0; k < std::min(a.size(), b.size()); ++k) {
    most = std::max(most, std::fabs(double(a[k]) - b[k]));
  }
  return most;
}

void turning(double x, double y, double& u, double& v) {
  u = -0.3 * y;
  v = 0.3 * x;
}

// The double precision of the same source is compiled apart from the kernels.
void check_simulate(Numbers& all) {
  Tank tank;
  tank.set_flow(turning);
  tank.sample_every(0.1, 11);
  synthetic::Batch batch;
  for (int k = 0; k < 21; ++k) {
    batch.add(0.004 * k, -0.03, 0.2 * k, 0.01, 0.02, 0.3, 0.45, 0.5e-3);
  }
  const auto paths = synthetic::simulate<float>(tank, batch);
  const auto twice = synthetic::simulate<double>(tank, batch);
  CHECK(farthest(paths.x, twice.x) < 1e-5 && farthest(paths.y, twice.y) < 1e-5);
  append(all, paths.x);
  append(all, paths.y);
  append(all, paths.theta);
  append(all, paths.status);
}

void check_assemble(Numbers& all) {
  Tank tank;
  tank.set_flow(turning);
  const driftwalk::PreparedRun<double> prepared(tank.finished());
  const driftwalk::AssemblyRules rules = synthetic::rules_in(prepared, 4);
  synthetic::Crowd crowd(4);
  for (std::uint64_t k = 0; k < 21; ++k) {
    crowd.add_random(rules, k, 0.45, 0.5e-3);
  }
  CHECK(crowd.worlds() > 16); // more than the widest pack holds
  const auto short_run = synthetic::assemble<float>(tank, rules, crowd, 20);
  CHECK(farthest(short_run.pose, synthetic::assemble<double>(tank, rules, crowd, 20).pose) < 1e-4);
  const auto run = synthetic::assemble<float>(tank, rules, crowd, 500);
  CHECK(*std::max_element(run.event_count.begin(), run.event_count.end()) > 0);
  append(all, run.pose);
  append(all, run.event_step);
  append(all, run.cell);
  append(all, run.status);
}

// A square across a uniform flow is pushed by 1/2 rho C_d a d U^2 / m.
template <int D>
void check_push(const driftwalk::DragModel& model, double wanted, Numbers& all) {
  const double still[2 * D] = {};
  double known[2 * D][2 * D] = {};
  for (int k = 0; k < 2 * D; ++k) {
    known[k][k] = 1e-16;
  }
  const driftwalk::DragResponse<D> drag = model.drag<D>(0, 0, still, known, nullptr);
  CHECK_NEAR(drag.acceleration[0] / wanted, 1.0, 1e-6);
  CHECK_NEAR(drag.acceleration[1] / wanted, 0.0, 1e-6);
  append(all, std::vector<double>(drag.acceleration, drag.acceleration + D));
}

void check_infer(Numbers& all) {
  const int nodes = 12;
  const double speed = 0.05, drag_coefficient = 0.5;
  const driftwalk::FloatingBlock block{0.03, 0.0116, 0.03, 8, 1000};
  const driftwalk::SplineView flow{nullptr, -0.09, -0.09, 0.02, nodes, nodes};
  std::vector<double> coefficients(2 * nodes * nodes);
  std::fill_n(coefficients.begin(), nodes * nodes, speed);
  std::vector<double> time, x, y, theta, omega;
  // No sine and cosine, which each system's C library ends in other digits.
  for (int k = 0; k < 60; ++k) {
    time.push_back(0.1 * k);
    x.push_back(0.03 - 7e-5 * k * k / 4 + 3e-5 * (k * 37 % 21 - 10));
    y.push_back(1.4e-3 * k * (1 - 4e-5 * k * k) + 3e-5 * (k * 29 % 21 - 10));
    theta.push_back(0.03 * k);
    omega.push_back(0.3);
  }
  const std::vector<std::uint8_t> excluded(time.size(), 0);
  const std::vector<double> right(3 * time.size(), 1.0);
  const driftwalk::Track track{time.data(),  x.data(), y.data(),        theta.data(),
                               omega.data(), nullptr,  excluded.data(), 60};
  const double wanted =
      0.5 * 1000 * drag_coefficient * block.side * block.depth * speed * speed / block.mass;
  for (const auto angle : {driftwalk::Angle::given, driftwalk::Angle::state}) {
    const driftwalk::DragModel model(block, flow, coefficients.data(), drag_coefficient, angle);
    if (angle == driftwalk::Angle::state) {
      check_push<3>(model, wanted, all);
    } else {
      check_push<2>(model, wanted, all);
    }
    driftwalk::InnovationsFilter filter(track, model, {4.5e-5, 3e-4, 1e-4, 0.01, 0.05, 1.0}, true);
    std::vector<double> innovation(3 * 60), covariance(6 * 60);
    std::vector<std::uint8_t> used(60), kept(60, 1);
    const auto sums =
        filter.sums(kept.data(), right.data(), 1, 1,
                    {innovation.data(), covariance.data(), used.data(), nullptr, nullptr, nullptr});
    CHECK(sums.information.front() >= 0 && sums.information.back() > 0);
    append(all, sums.information);
    append(all, sums.products);
  }
}

// On a diagonal both coordinates say the same, so D is that of one dimension: where one sample is
// the other moved by k - 1/2 places, k / n.
void check_ks(Numbers& all) {
  for (const int n : {50, 300}) {
    const int k = n / 7;
    std::vector<double> a, b;
    for (int place = 0; place < n; ++place) {
      a.push_back(place);
      b.push_back(place + k - 0.5);
    }
    const driftwalk::KsReference reference(a.data(), a.data(), n);
    driftwalk::KsWorkspace workspace;
    const auto result = driftwalk::ks_two_sample(reference, b.data(), b.data(), n, workspace);
    CHECK_NEAR(result.distance(), double(k) / n, 1e-15);
    all.push_back(result.distance());
  }
}

// FNV-1a over the bits: what .ci/cross compares between machines.
unsigned long long digest(const Numbers& all) {
  unsigned long long hash = 0xcbf29ce484222325ull;
  for (const double value : all) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    for (int byte = 0; byte < 8; ++byte) {
      hash = (hash ^ (bits >> (8 * byte) & 0xff)) * 0x100000001b3ull;
    }
  }
  return hash;
}

void report(InstructionSet set, const char* what, const Numbers& all, const Numbers& baseline) {
  CHECK(std::all_of(all.begin(), all.end(), [](double value) { return std::isfinite(value); }));
  CHECK(all == baseline);
  std::printf("%s: %s %zu numbers, digest %016llx\n", name(set), what, all.size(), digest(all));
}

// The compiler's own question to the processor, where its library has it.
void check_processor() {
#if defined(DRIFTWALK_X86_LANES) && defined(__linux__) && defined(__GLIBC__) && !defined(__zig__)
  CHECK(is_available(InstructionSet::avx2) == (__builtin_cpu_supports("avx2") != 0));
  CHECK(is_available(InstructionSet::avx512) ==
        (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
         __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl")));
#endif
}

} // namespace

int main() {
  Numbers baseline_simulated, baseline_fitted;
  for (const InstructionSet set :
       {InstructionSet::baseline, InstructionSet::avx2, InstructionSet::avx512}) {
    if (!is_available(set)) {
      std::printf("%s: not available here\n", name(set));
      continue;
    }
    environment::choose_instruction_set(name(set));
    // Apart, because a fit takes sine, cosine and exp from the C library.
    Numbers simulated, fitted;
    check_simulate(simulated);
    check_assemble(simulated);
    check_ks(simulated);
    check_infer(fitted);
    if (set == InstructionSet::baseline) {
      baseline_simulated = simulated;
      baseline_fitted = fitted;
    }
    report(set, "simulated", simulated, baseline_simulated);
    report(set, "fitted", fitted, baseline_fitted);
  }
  check_processor();
  return check::result();
}
