// Threads: every task runs once, failures come back, and results do not depend on their number.
#include "check.hpp"
#include "driftwalk/simulate/lanes.hpp"
#include "driftwalk/simulate/threads.hpp"
#include "synthetic_tank.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

void check_every_task_runs_once() {
  for (const int threads : {-3, 0, 1, 2, 3, 8, 50}) {
    for (const int tasks : {0, 1, 7, 1000}) {
      std::vector<std::atomic<int>> runs(static_cast<std::size_t>(tasks));
      std::atomic<int> workers{0};
      driftwalk::run_tasks(tasks, threads, [&] {
        ++workers;
        return [&](std::int64_t task) { ++runs[static_cast<std::size_t>(task)]; };
      });
      for (const std::atomic<int>& count : runs) {
        CHECK(count == 1);
      }
      CHECK(workers >= 1 && workers <= std::max(1, std::min(threads, std::max(tasks, 1))));
    }
  }
}

void check_failure_is_rethrown() {
  for (const int threads : {1, 4}) {
    std::atomic<int> done{0};
    bool caught = false;
    try {
      driftwalk::run_tasks(100000, threads, [&] {
        return [&](std::int64_t task) {
          if (task == 3) {
            throw std::runtime_error("task 3");
          }
          ++done;
        };
      });
    } catch (const std::runtime_error& error) {
      caught = std::string(error.what()) == "task 3";
    }
    CHECK(caught);
    CHECK(done < 100000);
  }
}

// Calls follow each other without a gap, none is too large, and threads that take them in turn end
// within one pack of each other.
void check_even_calls() {
  const driftwalk::SimulateKernel kernel{nullptr, 16};
  for (const int threads : {0, 1, 2, 3, 8}) {
    const auto workers = static_cast<std::size_t>(std::max(threads, 1));
    for (const int worlds : {0, 1, 6, 16, 17, 44, 64, 200, 292, 1681}) {
      const driftwalk::WorldCalls calls(kernel, worlds, threads);
      std::vector<int> packs(workers);
      std::int64_t next = 0;
      for (std::int64_t call = 0; call < calls.count(); ++call) {
        const int size = calls.size(call);
        CHECK(calls.first(call) == next && size > 0 && size <= calls.most());
        CHECK(size <= driftwalk::most_packs * kernel.lanes);
        packs[static_cast<std::size_t>(call) % workers] += (size + 15) / 16;
        next += size;
      }
      CHECK(next == worlds);
      const auto [least, most] = std::minmax_element(packs.begin(), packs.end());
      CHECK(*most - *least <= 1);
    }
  }
}

// Batch sizes, order and threads: world by world the same bits.
void check_same_bits() {
  synthetic::Tank tank;
  tank.set_flow([](double x, double y, double& u, double& v) {
    u = -0.31 * y + 0.02 * std::sin(30 * x);
    v = 0.31 * x;
  });
  tank.sample_every(0.1, 51);
  tank.model.position_noise = 2e-4;
  synthetic::Batch batch;
  synthetic::Uniform draw;
  for (int k = 0; k < 67; ++k) {
    batch.add(0.1 * draw(), 0.1 * draw(), 3 * draw(), 0.1 * draw(), 0, draw(), 0.5 + 0.4 * draw(),
              1e-3);
  }
  const auto one = synthetic::simulate<float>(tank, batch, 1);
  for (const int threads : {2, 3, 8}) {
    const auto several = synthetic::simulate<float>(tank, batch, threads);
    CHECK(several.x == one.x && several.y == one.y && several.theta == one.theta);
  }
  for (std::size_t world = 66; world < 67; world -= 6) {
    synthetic::Batch alone;
    alone.add(batch.x[world], batch.y[world], batch.theta[world], batch.vx[world], 0,
              batch.omega[world], batch.drag_coefficient[world], 1e-3);
    alone.key[0] = batch.key[world];
    const auto path = synthetic::simulate<float>(tank, alone, 1);
    for (std::size_t k = 0; k < 51; ++k) {
      CHECK(path.x[k] == one.x[world * 51 + k] && path.theta[k] == one.theta[world * 51 + k]);
    }
  }
}

} // namespace

int main() {
  check_every_task_runs_once();
  check_failure_is_rethrown();
  check_even_calls();
  check_same_bits();
  return check::result();
}
