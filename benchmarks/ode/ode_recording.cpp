// Poses of the one block of a CASE (tank.hpp) over time, the wall by impulse.
//
//     ode_recording CASE SEED STEPS_PER_FORCE SKIPPED SAMPLES [NAME=NUMBER ...]
//
// The stochastic force is redrawn every STEPS_PER_FORCE steps and held in between. After SKIPPED
// samples, SAMPLES lines of x, y, theta [m, m, rad] are printed, in as many digits as a double has.
// Each NAME is a number of Law (tank.hpp), or force_memory [s]: the force then forgets
// exponentially, with the intensity it had without.
#include "tank.hpp"

#include <array>
#include <map>
#include <random>
#include <string>

namespace {

// Hands out x and y of the force in turn, as Tank::step asks for them.
class HeldForce {
public:
  // `kept` of a force is there when the next is drawn.
  HeldForce(std::uint64_t seed, int steps, double kept)
      : random_(seed), kept_(kept), fresh_(1 - kept), calls_(2 * steps) {}

  double operator()() {
    if (call_ == 0) {
      held_ = {kept_ * held_[0] + fresh_ * normal_(random_),
               kept_ * held_[1] + fresh_ * normal_(random_)};
    }
    const double value = held_[static_cast<std::size_t>(call_ % 2)];
    call_ = (call_ + 1) % calls_;
    return value;
  }

private:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::array<double, 2> held_{};
  double kept_, fresh_;
  int calls_, call_ = 0;
};

// Takes NAME=NUMBER into the law, and returns the memory of the force [s].
double read_law(int count, char** words, Law& law) {
  double memory = 0;
  const std::map<std::string, double*> known = {
      {"added_mass", &law.added_mass}, {"pressure_gradient", &law.pressure_gradient},
      {"water_spin", &law.water_spin}, {"linear_drag", &law.linear_drag},
      {"drag_power", &law.drag_power}, {"flow_growth", &law.flow_growth},
      {"pulse", &law.pulse},           {"pulse_period", &law.pulse_period},
      {"force_memory", &memory},       {"disc", &law.disc},
  };
  for (int k = 0; k < count; ++k) {
    const std::string word = words[k];
    const std::size_t middle = word.find('=');
    const auto found = known.find(word.substr(0, middle));
    if (middle == std::string::npos || found == known.end()) {
      std::cerr << "ode_recording knows no " << word << "\n";
      std::exit(2);
    }
    *found->second = std::stod(word.substr(middle + 1));
  }
  return memory;
}

} // namespace

int main(int argc, char** argv) {
  if (argc < 6) {
    std::cerr
        << "usage: ode_recording CASE SEED STEPS_PER_FORCE SKIPPED SAMPLES [NAME=NUMBER ...]\n";
    return 2;
  }
  Case c = read_case(argv[1]);
  const double memory = read_law(argc - 6, argv + 6, c.law);
  if (c.starts.size() != 1) {
    std::cerr << "ode_recording takes a case of one block, got " << c.starts.size() << "\n";
    return 2;
  }
  const int held = std::stoi(argv[3]);
  HeldForce force(std::stoull(argv[2]), held, memory > 0 ? std::exp(-held * c.dt / memory) : 0);
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
