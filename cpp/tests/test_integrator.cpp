// The integrator against exact solutions and against itself at smaller steps.
#include "check.hpp"
#include "synthetic_tank.hpp"

#include <algorithm>
#include <cmath>

namespace {

using synthetic::Batch;
using synthetic::Tank;

// A block along a uniform flow U: m dv/dt = 1/2 rho C_d a d (U - v)^2, so with k = 1/2 rho C_d a
// d/m the slip is q0 / (1 + k q0 t) and the path U t - ln(1 + k q0 t) / k.
void check_relaxation() {
  Tank tank;
  tank.model.radius = 1;
  tank.set_flow([](double, double, double& u, double& v) {
    u = 0.05;
    v = 0;
  });
  tank.sample_every(0.1, 101);
  Batch batch;
  batch.add(-0.2, 0.03, 0.0);
  const double k = 0.5 * 1000 * 0.45 * 0.03 * 0.03 / 0.0116;
  double error[2];
  for (const int halving : {0, 1}) {
    tank.model.time_step = halving == 0 ? 0.01 : 0.005;
    const auto path = synthetic::simulate<double>(tank, batch);
    error[halving] = 0;
    for (std::size_t s = 0; s < path.x.size(); ++s) {
      const double t = tank.sample_time[s];
      const double exact = -0.2 + 0.05 * t - std::log(1 + k * 0.05 * t) / k;
      error[halving] = std::max(error[halving], std::fabs(path.x[s] - exact));
      CHECK_NEAR(path.y[s], 0.03, 1e-15);
      CHECK_NEAR(path.theta[s], 0.0, 1e-12);
    }
  }
  std::printf("relaxation: error %.3g m at 10 ms, %.3g m at 5 ms\n", error[0], error[1]);
  CHECK(error[0] < 1e-6);
  CHECK(error[0] / error[1] > 3.5 && error[0] / error[1] < 4.5);
}

// A spinning block in still water: on each face the strips of one half push, each with the moment
// K w^2 o (h^2 + o^2), so dw/dt = -c w^2 and the angle is ln(1 + c w0 t) / c.
void check_spin_decay() {
  for (const int strips : {1, 2, 8, 63, 64}) {
    Tank tank;
    tank.model.strips = strips;
    tank.set_flow([](double, double, double& u, double& v) { u = v = 0; });
    tank.sample_every(0.1, 51);
    const double half = tank.model.side / 2, width = tank.model.side / strips;
    double moment = 0;
    for (int strip = 0; strip < strips; ++strip) {
      const double offset = width * (strip + 0.5) - half;
      moment += std::max(offset, 0.0) * (half * half + offset * offset);
    }
    const double c = 4 * 0.5 * 1000 * 0.45 * width * 0.03 * moment / tank.model.inertia;
    const double spin = 0.8;
    Batch batch;
    batch.add(0.01, -0.02, 0.4, 0, 0, spin);
    const auto path = synthetic::simulate<double>(tank, batch);
    double error = 0;
    for (std::size_t s = 0; s < path.x.size(); ++s) {
      const double t = tank.sample_time[s];
      const double turned = c > 1e-9 ? std::log(1 + c * spin * t) / c : spin * t;
      error = std::max(
          error, std::fabs(std::remainder(path.theta[s] - 0.4 - turned, 2 * std::acos(-1.0))));
      CHECK_NEAR(path.x[s], 0.01, 1e-14);
      CHECK_NEAR(path.y[s], -0.02, 1e-14);
    }
    std::printf("spin decay, %d strips: c = %.4f, error %.3g rad\n", strips, c, error);
    CHECK(error < 2e-5);
  }
}

// Error against a path of 32 times smaller steps; the noise is the same in all.
double path_error(int parts, double force, const Batch& batch, Tank& tank,
                  const synthetic::Paths<double>& exact) {
  tank.model.time_step = 0.04 / parts;
  tank.model.steps_per_interval = parts;
  Batch forced = batch;
  std::fill(forced.force_std.begin(), forced.force_std.end(), force);
  const auto path = synthetic::simulate<double>(tank, forced);
  double error = 0;
  for (std::size_t k = 0; k < path.x.size(); ++k) {
    error = std::max(
        {error, std::fabs(path.x[k] - exact.x[k]), std::fabs(path.y[k] - exact.y[k]),
         0.01 * std::fabs(std::remainder(path.theta[k] - exact.theta[k], 2 * 3.141592653589793))});
  }
  return error;
}

// Smooth flow (linear, so the table adds no kinks), no wall: error by 4 for every halving, without
// noise and with a noise that does not depend on the step.
void check_second_order() {
  Tank tank;
  tank.model.radius = 1;
  tank.set_flow([](double x, double y, double& u, double& v) {
    u = -0.31 * y;
    v = 0.155 * x;
  });
  tank.sample_every(0.4, 6);
  Batch batch;
  batch.add(0.1, 0.0, 0.3, 0.02, -0.03, 2.0);
  batch.add(-0.05, 0.12, 2.0, 0.0, 0.05, -1.0, 1.5);
  for (const double force : {0.0, 0.5e-3}) {
    tank.model.time_step = 0.04 / 256;
    tank.model.steps_per_interval = 256;
    Batch forced = batch;
    std::fill(forced.force_std.begin(), forced.force_std.end(), force);
    const auto exact = synthetic::simulate<double>(tank, forced);
    double previous = 0;
    for (const int parts : {2, 4, 8, 16}) {
      const double error = path_error(parts, force, batch, tank, exact);
      std::printf("force %g N, step %.4g ms: error %.3g m, ratio %.2f\n", force, 40.0 / parts,
                  error, previous / error);
      if (previous > 0) {
        CHECK(previous / error > 3.3 && previous / error < 5.0);
      }
      previous = error;
    }
  }
}

// Without drag the path is a polygon of parabolas, exact at any step.
void check_force_without_drag() {
  Tank tank;
  tank.model.radius = 1;
  tank.set_flow([](double, double, double& u, double& v) { u = v = 0; });
  tank.sample_every(0.04, 26);
  Batch batch;
  batch.add(0, 0, 0.1, 0, 0, 0, 0.0, 1e-3);
  tank.model.time_step = 0.04;
  const auto coarse = synthetic::simulate<double>(tank, batch);
  tank.model.time_step = 0.01;
  tank.model.steps_per_interval = 4;
  const auto fine = synthetic::simulate<double>(tank, batch);
  for (std::size_t k = 0; k < coarse.x.size(); ++k) {
    CHECK_NEAR(coarse.x[k], fine.x[k], 1e-15);
    CHECK_NEAR(coarse.y[k], fine.y[k], 1e-15);
  }
  CHECK(std::fabs(coarse.x[25]) > 1e-4);
}

} // namespace

int main() {
  check_relaxation();
  check_spin_decay();
  check_second_order();
  check_force_without_drag();
  return check::result();
}
