// Whole runs: float against double, samples, status, tanks of every shape, flow that varies in
// time.
#include "check.hpp"
#include "driftwalk/dispatch.hpp"
#include "environment.hpp"
#include "synthetic_tank.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>

namespace {

using synthetic::Batch;
using synthetic::Paths;
using synthetic::Tank;

void swirl(double x, double y, double& u, double& v) {
  const double q = std::hypot(x, y) / 0.15;
  const double speed = 0.05 * q * (1.5 - q);
  u = -speed * y / 0.15 + 0.01 * std::sin(40 * y);
  v = speed * x / 0.15 + 0.01 * std::cos(40 * x);
}

Batch many_worlds(int count, double drag, double force) {
  Batch batch;
  synthetic::Uniform draw;
  for (int k = 0; k < count; ++k) {
    batch.add(0.09 * draw(), 0.09 * draw(), 3 * draw(), 0.05 * draw(), 0.05 * draw(), draw(), drag,
              force);
  }
  return batch;
}

void check_float_against_double() {
  Tank tank;
  tank.set_flow(swirl);
  tank.sample_every(0.1, 11);
  Batch batch = many_worlds(101, 0.45, 0.55e-3);
  const auto single = synthetic::simulate<float>(tank, batch);
  const auto twice = synthetic::simulate<double>(tank, batch);
  double worst = 0;
  for (std::size_t k = 0; k < twice.x.size(); ++k) {
    worst =
        std::max({worst, std::fabs(single.x[k] - twice.x[k]), std::fabs(single.y[k] - twice.y[k])});
  }
  std::printf("float against double over 1 s: %.3g m\n", worst);
  CHECK(worst < 5e-6);
}

double deepest_corner(const Tank& tank, double x, double y, double theta) {
  double depth = -1;
  for (int corner = 0; corner < 4; ++corner) {
    const double angle = theta + (corner + 0.5) * std::acos(-1.0) / 2;
    const double cx = x + tank.model.side * std::sqrt(0.5) * std::cos(angle);
    const double cy = y + tank.model.side * std::sqrt(0.5) * std::sin(angle);
    if (tank.edges.empty()) {
      depth = std::max(depth, std::hypot(cx, cy) - tank.model.radius);
    }
    for (std::size_t e = 0; e < tank.edges.size(); e += 3) {
      depth = std::max(depth, tank.edges[e] * cx + tank.edges[e + 1] * cy - tank.edges[e + 2]);
    }
  }
  return depth;
}

// The corners of the box of parameters, and beyond what it needs, in every shape of tank.
void check_stability(Tank& tank, const char* name) {
  tank.set_flow(swirl);
  tank.sample_every(0.05, 401);
  Batch batch;
  for (const double drag : {0.0, 0.1, 1.0, 4.0}) {
    for (const double force : {0.0, 0.5e-3, 2e-3, 4e-3}) {
      for (int k = 0; k < 3; ++k) {
        batch.add(0.02 * k, -0.01, 0.7 * k, 0, 0, 0, drag, force);
      }
    }
  }
  const auto paths = synthetic::simulate<float>(tank, batch);
  double outside = -1;
  for (std::size_t k = 0; k < paths.x.size(); ++k) {
    CHECK(std::isfinite(paths.x[k]) && std::isfinite(paths.y[k]) && std::isfinite(paths.theta[k]));
    CHECK(std::fabs(paths.theta[k]) <= 3.1415928f);
    outside = std::max(outside, deepest_corner(tank, paths.x[k], paths.y[k], paths.theta[k]));
  }
  std::printf("%s: farthest corner outside %.3g m\n", name, outside);
  CHECK(outside < 1e-6);
  CHECK(outside > -0.01);
  for (const std::uint32_t status : paths.status) {
    CHECK((status & ~driftwalk::status_no_motion) == 0);
  }
}

void check_tanks() {
  Tank circle;
  check_stability(circle, "circle");
  Tank rectangle;
  rectangle.model.radius = 0;
  rectangle.edges = {0, -1, 0.08, 1, 0, 0.12, 0, 1, 0.08, -1, 0, 0.12};
  check_stability(rectangle, "rectangle");
  Tank triangle;
  triangle.model.radius = 0;
  const double s = std::sqrt(0.75);
  triangle.edges = {0, -1, 0.08, s, 0.5, 0.08, -s, 0.5, 0.08};
  check_stability(triangle, "triangle");
}

void check_status() {
  Tank tank;
  tank.set_flow([](double, double, double& u, double& v) { u = v = 0; });
  tank.sample_every(0.1, 101);
  Batch batch = many_worlds(37, 0.45, 0.55e-3);
  const auto sound = synthetic::simulate<float>(tank, batch);
  batch.force_std[5] = 1e38; // beyond float after a few steps
  batch.force_std[6] = 0;
  batch.vx[6] = batch.vy[6] = batch.omega[6] = 0;
  batch.x[7] = NAN;
  const auto mixed = synthetic::simulate<float>(tank, batch);
  CHECK((mixed.status[5] & driftwalk::status_non_finite) != 0);
  CHECK(mixed.status[6] == driftwalk::status_no_motion);
  CHECK((mixed.status[7] & driftwalk::status_non_finite) != 0);
  for (std::size_t world = 0; world < 37; ++world) {
    if (world < 5 || world > 7) {
      CHECK(mixed.status[world] == driftwalk::status_ok);
      for (std::size_t k = world * 101; k < (world + 1) * 101; ++k) {
        CHECK(mixed.x[k] == sound.x[k] && mixed.y[k] == sound.y[k] &&
              mixed.theta[k] == sound.theta[k]);
      }
    }
  }
  const auto twice = synthetic::simulate<double>(tank, batch);
  CHECK((twice.status[7] & driftwalk::status_non_finite) != 0);
  CHECK(twice.status[6] == driftwalk::status_no_motion);
}

// A pose that is no number stays none, also where positions are rounded.
void check_rounding_keeps_failures() {
  Tank tank;
  tank.set_flow([](double, double, double& u, double& v) { u = v = 0; });
  tank.sample_every(0.1, 3);
  Batch batch;
  batch.add(NAN, 0, 0);
  batch.add(0.05, 0.0123456789, 0);
  tank.model.position_quantum = 1e-4;
  CHECK(std::isnan(synthetic::simulate<float>(tank, batch).x[1]));
  CHECK(std::isnan(synthetic::simulate<double>(tank, batch).x[1]));
  CHECK_NEAR(synthetic::simulate<double>(tank, batch).y[3], 0.0123, 1e-15);
  // Finer than any number of steps that fits into 32 bits: the position itself.
  tank.model.position_quantum = 1e-12;
  CHECK_NEAR(synthetic::simulate<float>(tank, batch).x[3], 0.05, 1e-8);
  CHECK_NEAR(synthetic::simulate<double>(tank, batch).x[3], 0.05, 1e-11);
}

// A start angle of many turns is the same orientation.
void check_start_angle() {
  Tank tank;
  tank.set_flow(swirl);
  tank.sample_every(0.1, 21);
  Batch near, far;
  for (const double turns : {-7.0, 1.0, 2.0, 100.0}) {
    near.add(0.05, 0.02, 0.5, 0.02, 0.01, 0.5);
    far.add(0.05, 0.02, 0.5 + turns * 2 * std::acos(-1.0), 0.02, 0.01, 0.5);
  }
  far.key = near.key;
  const auto a = synthetic::simulate<double>(tank, near);
  const auto b = synthetic::simulate<double>(tank, far);
  const auto c = synthetic::simulate<float>(tank, far);
  for (std::size_t k = 0; k < a.x.size(); ++k) {
    CHECK_NEAR(a.x[k], b.x[k], 1e-10);
    CHECK_NEAR(a.theta[k], b.theta[k], 1e-9);
    CHECK_NEAR(a.x[k], double(c.x[k]), 1e-5);
    CHECK_NEAR(std::remainder(a.theta[k] - double(c.theta[k]), 2 * std::acos(-1.0)), 0.0, 1e-3);
  }
}

// Two equal frames are a steady flow, bit for bit.
void check_equal_frames() {
  Tank tank;
  tank.set_flow(swirl);
  tank.sample_every(0.1, 31);
  Batch batch = many_worlds(9, 0.45, 0.55e-3);
  const auto steady = synthetic::simulate<float>(tank, batch);
  driftwalk::BatchModel model = tank.finished();
  std::vector<double> u(tank.u), v(tank.v);
  u.insert(u.end(), tank.u.begin(), tank.u.end());
  v.insert(v.end(), tank.v.begin(), tank.v.end());
  const double times[] = {0.0, 2.0};
  model.flow_u = u.data();
  model.flow_v = v.data();
  model.frames = 2;
  model.frame_time = times;
  const driftwalk::PreparedRun<float> run(model);
  Paths<float> paths{std::vector<float>(9 * 31), std::vector<float>(9 * 31),
                     std::vector<float>(9 * 31), std::vector<std::uint32_t>(9)};
  driftwalk::simulate_batch(
      run, batch.view(), 2,
      {paths.x.data(), paths.y.data(), paths.theta.data(), paths.status.data()});
  CHECK(paths.x == steady.x && paths.y == steady.y && paths.theta == steady.theta);
}

// The same bits on every instruction set of this machine.
void check_instruction_sets(Tank tank) {
  tank.set_flow(swirl);
  tank.sample_every(0.1, 101);
  tank.model.position_noise = 1e-4;
  tank.model.orientation_noise = 0.01;
  tank.model.friction = 0.3;
  Batch batch = many_worlds(53, 0.45, 2e-3);
  environment::choose_instruction_set("baseline");
  const auto baseline = synthetic::simulate<float>(tank, batch);
  for (const auto set : {driftwalk::InstructionSet::avx2, driftwalk::InstructionSet::avx512}) {
    if (driftwalk::is_available(set)) {
      environment::choose_instruction_set(driftwalk::name(set));
      const auto paths = synthetic::simulate<float>(tank, batch);
      CHECK(paths.x == baseline.x && paths.y == baseline.y && paths.theta == baseline.theta);
    }
  }
  environment::choose_instruction_set("");
}

void check_unknown_instruction_set() {
  environment::choose_instruction_set("quantum");
  bool refused = false;
  try {
    driftwalk::chosen_instruction_set();
  } catch (const std::exception& error) {
    refused = std::string(error.what()).find("quantum") != std::string::npos;
  }
  CHECK(refused);
  environment::choose_instruction_set("");
}

} // namespace

int main() {
  check_float_against_double();
  check_tanks();
  check_status();
  check_rounding_keeps_failures();
  check_start_angle();
  check_equal_frames();
  Tank floating;
  floating.let_float();
  check_instruction_sets(Tank());
  check_instruction_sets(floating);
  check_unknown_instruction_set();
  return check::result();
}
