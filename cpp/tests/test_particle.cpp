// Self-propelled particles without Python: every feature at once, float against double, instruction
// sets, companions in a pack, and walls of both shapes.
#include "check.hpp"
#include "driftwalk/dispatch.hpp"
#include "environment.hpp"
#include "synthetic_tank.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

namespace {

using driftwalk::ParticleKind;
using driftwalk::WallContact;
using synthetic::Tank;

// Particles of two states with all that a table can hold, or with a velocity that forgets.
struct Particles {
  synthetic::Batch batch;
  driftwalk::ParticleModel model;
  std::vector<double> values;

  Particles(ParticleKind kind, WallContact contact, int count) {
    synthetic::Uniform draw;
    for (int k = 0; k < count; ++k) {
      batch.add(0.09 * draw(), 0.09 * draw(), 9 * draw(), 0.05 * draw(), 0.05 * draw());
    }
    model.kind = kind;
    model.contact = contact;
    model.carried = true;
    const std::vector<double> row =
        kind == ParticleKind::inertial ? std::vector<double>{0.01, 0.04, 1.0, 0.5} : two_states();
    model.states = kind == ParticleKind::inertial ? 0 : 2;
    for (const double value : row) {
      values.insert(values.end(), static_cast<std::size_t>(count), value);
    }
  }

  // At two steps: one that moves, and one that is not there any more.
  static constexpr double others[8] = {0.05, 0.0, 0.0, -0.06, 0.051, 0.001, NAN, NAN};

  static std::vector<double> two_states() {
    return {// clearance, diffusion, slow, stroke, wall, neighbours
            0.01, 1e-7, 0.3, 3.0, 0.5, 1.3, 3.0, 2.0, 0.5, 0.02, 0.03, 0.7, 0.03,
            // a run: dwell, share, speed, relaxation, turns, the state that follows
            0.8, 0.6, 0.5, 0.04, 0.4, 0.0, 0.0, 0.4, 0.3, 0.5, 1.0, 0.2, 0.3, 0.7,
            // a glide
            0.6, 1.0, 0.5, 0.05, 0.3, 0.4, 1.0, 0.0, 0.0, 0.0, 0.5, 0.0, 1.0, 0.0};
  }

  driftwalk::BatchWorlds view() const {
    driftwalk::BatchWorlds worlds = batch.view();
    worlds.particle = model;
    worlds.particle.values = values.data();
    worlds.particle.neighbours = {2, 2, others};
    return worlds;
  }
};

template <class T>
synthetic::Paths<T> simulate(Tank& tank, const Particles& particles) {
  const driftwalk::PreparedRun<T> run(tank.finished());
  synthetic::Paths<T> paths;
  const std::size_t count = particles.batch.x.size();
  const std::size_t size = count * tank.sample_time.size();
  paths.x.resize(size);
  paths.y.resize(size);
  paths.theta.resize(size);
  paths.status.resize(count);
  driftwalk::simulate_batch(
      run, particles.view(), 1,
      {paths.x.data(), paths.y.data(), paths.theta.data(), paths.status.data()});
  return paths;
}

Tank swirling(double seconds, bool square) {
  Tank tank;
  tank.set_flow([](double x, double y, double& u, double& v) {
    u = -0.3 * y;
    v = 0.3 * x;
  });
  tank.sample_every(0.1, static_cast<int>(seconds * 10) + 1);
  if (square) {
    tank.model.radius = 0;
    tank.edges = {1, 0, 0.15, 0, 1, 0.15, -1, 0, 0.15, 0, -1, 0.15};
  }
  return tank;
}

double reach(const Tank& tank, double x, double y) {
  return tank.edges.empty() ? std::hypot(x, y) : std::max(std::fabs(x), std::fabs(y));
}

void check_float_against_double(ParticleKind kind, WallContact contact, bool square) {
  Tank tank = swirling(1, square);
  const Particles particles(kind, contact, 101);
  const auto single = simulate<float>(tank, particles);
  const auto twice = simulate<double>(tank, particles);
  std::vector<double> off;
  for (std::size_t k = 0; k < twice.x.size(); ++k) {
    off.push_back(std::hypot(single.x[k] - twice.x[k], single.y[k] - twice.y[k]));
    CHECK(reach(tank, single.x[k], single.y[k]) < 0.14 + 1e-6);
    CHECK(std::fabs(single.theta[k]) < 3.1416f);
  }
  // A bout that begins a step earlier in one of them, or a bounce, parts a few worlds.
  std::sort(off.begin(), off.end());
  CHECK(off[off.size() * 9 / 10] < 5e-6);
  for (const std::uint32_t status : single.status) {
    CHECK(status == 0);
  }
}

void check_instruction_sets_and_companions(ParticleKind kind) {
  Tank tank = swirling(20, false);
  const auto all = simulate<float>(tank, Particles(kind, WallContact::slide, 37));
  for (const char* set : {"baseline", "avx2", "avx512"}) {
    if (!driftwalk::is_available(driftwalk::InstructionSet::avx512) &&
        std::string(set) == "avx512") {
      continue;
    }
    if (!driftwalk::is_available(driftwalk::InstructionSet::avx2) && std::string(set) == "avx2") {
      continue;
    }
    environment::choose_instruction_set(set);
    const auto same = simulate<float>(tank, Particles(kind, WallContact::slide, 37));
    CHECK(same.x == all.x);
    CHECK(same.theta == all.theta);
  }
  environment::choose_instruction_set("");
  const auto few = simulate<float>(tank, Particles(kind, WallContact::slide, 3));
  CHECK(std::equal(few.x.begin(), few.x.end(), all.x.begin()));
  CHECK(std::equal(few.y.begin(), few.y.end(), all.y.begin()));
}

} // namespace

int main() {
  for (const ParticleKind kind : {ParticleKind::switching, ParticleKind::inertial}) {
    for (const WallContact contact : {WallContact::slide, WallContact::reflect}) {
      check_float_against_double(kind, contact, false);
      check_float_against_double(kind, contact, true);
    }
    check_instruction_sets_and_companions(kind);
  }
  return check::result();
}
