// Poses of the one block of a CASE (tank.hpp) over time, the wall by impulse.
//
//     ode_recording CASE SEED STEPS_PER_FORCE SKIPPED SAMPLES
//
// The stochastic force is redrawn every STEPS_PER_FORCE steps and held in between. After SKIPPED
// samples, SAMPLES lines of x, y, theta [m, m, rad] are printed, in as many digits as a double has.
#include "tank.hpp"

#include <array>
#include <random>
#include <string>

namespace {

// Hands out x and y of the force in turn, as Tank::step asks for them.
class HeldForce {
public:
  HeldForce(std::uint64_t seed, int steps) : random_(seed), calls_(2 * steps) {}

  double operator()() {
    if (call_ == 0) {
      held_ = {normal_(random_), normal_(random_)};
    }
    const double value = held_[static_cast<std::size_t>(call_ % 2)];
    call_ = (call_ + 1) % calls_;
    return value;
  }

private:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::array<double, 2> held_{};
  int calls_, call_ = 0;
};

} // namespace

int main(int argc, char** argv) {
  if (argc != 6) {
    std::cerr << "usage: ode_recording CASE SEED STEPS_PER_FORCE SKIPPED SAMPLES\n";
    return 2;
  }
  const Case c = read_case(argv[1]);
  if (c.starts.size() != 1) {
    std::cerr << "ode_recording takes a case of one block, got " << c.starts.size() << "\n";
    return 2;
  }
  HeldForce force(std::stoull(argv[2]), std::stoi(argv[3]));
  const int skipped = std::stoi(argv[4]), samples = std::stoi(argv[5]);
  dInitODE();
  {
    Tank tank(c, false);
    tank.place(c.starts.data());
    std::cout.precision(17);
    for (int sample = 0; sample < skipped + samples; ++sample) {
      if (sample >= skipped) {
        const State s = tank.state(0);
        std::cout << s.x << ' ' << s.y << ' ' << std::atan2(s.sine, s.cosine) << '\n';
      }
      for (int step = 0; step < c.period; ++step) {
        tank.step(c.starts.data(), force);
      }
    }
  }
  dCloseODE();
  return 0;
}
