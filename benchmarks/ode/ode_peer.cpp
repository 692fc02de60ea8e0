// The peer of bench_ode.py and bench_assemble.py: how fast ODE moves the blocks of a CASE, see
// tank.hpp.
//
//     ode_peer CASE impulse|boxes STEPS
//
// Printed: one line of JSON.
#include "tank.hpp"

#include <chrono>
#include <ctime>
#include <random>
#include <string>

namespace {

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

} // namespace

int main(int argc, char** argv) {
  const std::string wall = argc == 4 ? argv[2] : "";
  if (wall != "impulse" && wall != "boxes") {
    std::cerr << "usage: ode_peer CASE impulse|boxes STEPS\n";
    return 2;
  }
  const Case c = read_case(argv[1]);
  const int steps = std::stoi(argv[3]);
  const auto setup = std::chrono::steady_clock::now();
  dInitODE();
  std::vector<double> lengths, largest;
  double setup_s = 0, run_s = 0, processor_s = 0;
  {
    Tank tank(c, wall == "boxes");
    setup_s = seconds_since(setup);
    std::mt19937_64 random(7);
    std::normal_distribution<double> normal;
    const auto noise = [&] { return normal(random); };
    std::vector<State> last(c.blocks);
    const auto run = std::chrono::steady_clock::now();
    const std::clock_t processor = std::clock();
    for (std::size_t world = 0; world < c.worlds; ++world) {
      const Start* const start = &c.starts[world * c.blocks];
      tank.place(start);
      for (std::size_t b = 0; b < c.blocks; ++b) {
        last[b] = tank.state(b);
      }
      for (int step = 1; step <= steps; ++step) {
        tank.step(start, noise);
        for (std::size_t b = 0; step % c.period == 0 && b < c.blocks; ++b) {
          const State now = tank.state(b);
          lengths.push_back(std::hypot(now.x - last[b].x, now.y - last[b].y));
          largest.push_back(std::hypot(now.x, now.y));
          last[b] = now;
        }
      }
    }
    run_s = seconds_since(run);
    processor_s = static_cast<double>(std::clock() - processor) / CLOCKS_PER_SEC;
  }
  dCloseODE();
  double sum = 0;
  for (const double length : lengths) {
    sum += length;
  }
  std::cout.precision(9);
  std::cout << "{\"block_steps\": " << static_cast<double>(steps) * c.starts.size()
            << ", \"setup_s\": " << setup_s << ", \"run_s\": " << run_s
            << ", \"processor_s\": " << processor_s
            << ", \"mean_step_length_m\": " << sum / static_cast<double>(lengths.size())
            << ", \"largest_distance_m\": " << *std::max_element(largest.begin(), largest.end())
            << "}\n";
  return 0;
}
