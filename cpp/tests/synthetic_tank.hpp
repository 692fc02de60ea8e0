// Synthetic models for the tests: the paper's block in a tank, with a flow given by a formula.
#pragma once

#include "driftwalk/simulate/prepare.hpp"
#include "driftwalk/simulate/simulate.hpp"

#include <cmath>
#include <cstdint>
#include <vector>

namespace synthetic {

// Nodes at -31 .. 31 spacings: a flow that is linear in them is a whole number of quanta
// (32767 = 31 * 1057), so the 16-bit table holds it exactly.
struct Tank {
  int nodes = 63;
  double spacing = 0.01;
  driftwalk::BatchModel model;
  std::vector<double> u, v, frame_time{0.0}, sample_time, edges;

  Tank() {
    model.side = 0.03;
    model.mass = 0.0116;
    model.inertia = model.mass * model.side * model.side / 6;
    model.depth = 0.03;
    model.strips = 8;
    model.water_density = 1000;
    model.drag_power = 2;
    model.drag_speed = 0.03;
    model.radius = 0.15;
    model.restitution = 0.5;
    model.bounce_speed = 0.01;
    model.time_step = 0.01;
    model.steps_per_interval = 1;
  }

  // All that a floating body feels beyond the paper's law. A share of 1 is exact in ratios.
  void let_float() {
    model.added_mass_share = 1;
    model.displaced_mass = model.mass;
    model.linear_drag = 4e-3;
    model.force_memory = 0.05;
  }

  template <class Velocity>
  void set_flow(const Velocity& velocity) {
    u.clear();
    v.clear();
    for (int row = 0; row < nodes; ++row) {
      for (int column = 0; column < nodes; ++column) {
        double node_u, node_v;
        velocity((column - (nodes - 1) / 2) * spacing, (row - (nodes - 1) / 2) * spacing, node_u,
                 node_v);
        u.push_back(node_u);
        v.push_back(node_v);
      }
    }
  }
  void sample_every(double interval, int count) {
    sample_time.clear();
    for (int k = 0; k < count; ++k) {
      sample_time.push_back(k * interval);
    }
  }
  const driftwalk::BatchModel& finished() {
    model.flow_u = u.data();
    model.flow_v = v.data();
    model.frames = 1;
    model.rows = model.columns = nodes;
    model.origin_x = model.origin_y = -(nodes - 1) / 2 * spacing;
    model.spacing_x = model.spacing_y = spacing;
    model.frame_time = frame_time.data();
    model.sample_time = sample_time.data();
    model.samples = static_cast<std::int64_t>(sample_time.size());
    model.edges = edges.data();
    model.edge_count = static_cast<int>(edges.size() / 3);
    return model;
  }
};

// Worlds and their paths.
struct Batch {
  std::vector<double> x, y, theta, vx, vy, omega, drag_coefficient, force_std;
  std::vector<std::uint64_t> key;

  void add(double px, double py, double angle, double speed_x = 0, double speed_y = 0,
           double spin = 0, double drag = 0.45, double force = 0.0) {
    x.push_back(px);
    y.push_back(py);
    theta.push_back(angle);
    vx.push_back(speed_x);
    vy.push_back(speed_y);
    omega.push_back(spin);
    drag_coefficient.push_back(drag);
    force_std.push_back(force);
    key.push_back(0x9E3779B97F4A7C15ull * (key.size() + 1));
  }
  driftwalk::BatchWorlds view() const {
    driftwalk::BatchWorlds worlds;
    worlds.count = static_cast<std::int64_t>(x.size());
    worlds.x = x.data();
    worlds.y = y.data();
    worlds.theta = theta.data();
    worlds.vx = vx.data();
    worlds.vy = vy.data();
    worlds.omega = omega.data();
    worlds.drag_coefficient = drag_coefficient.data();
    worlds.force_std = force_std.data();
    worlds.key = key.data();
    return worlds;
  }
};

template <class T>
struct Paths {
  std::vector<T> x, y, theta;
  std::vector<std::uint32_t> status;
};

template <class T>
Paths<T> simulate(Tank& tank, const Batch& batch, int threads = 1) {
  const driftwalk::PreparedRun<T> run(tank.finished());
  Paths<T> paths;
  const std::size_t size = batch.x.size() * tank.sample_time.size();
  paths.x.resize(size);
  paths.y.resize(size);
  paths.theta.resize(size);
  paths.status.resize(batch.x.size());
  driftwalk::simulate_batch(
      run, batch.view(), threads,
      {paths.x.data(), paths.y.data(), paths.theta.data(), paths.status.data()});
  return paths;
}

// A cheap generator of numbers in [-1, 1] for the tests' own choices.
class Uniform {
public:
  double operator()() {
    state_ = state_ * 6364136223846793005ull + 1442695040888963407ull;
    return double(state_ >> 11) * 0x1p-52 - 1.0;
  }

private:
  std::uint64_t state_ = 12345;
};

} // namespace synthetic
