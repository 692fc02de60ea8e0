// Runs numbered tasks on a few threads. Which thread runs a task never changes its result.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace driftwalk {

// `make_worker()` is called once on each thread and gives a callable that takes a task's number.
// The first exception of a worker is rethrown here, after all threads have ended.
template <class MakeWorker>
void run_tasks(std::int64_t tasks, int threads, const MakeWorker& make_worker) {
  std::atomic<std::int64_t> next{0};
  std::exception_ptr failure;
  std::mutex failure_mutex;
  const auto work = [&] {
    try {
      auto worker = make_worker();
      for (std::int64_t task = next++; task < tasks; task = next++) {
        worker(task);
      }
    } catch (...) {
      next = tasks;
      const std::lock_guard<std::mutex> lock(failure_mutex);
      if (!failure) {
        failure = std::current_exception();
      }
    }
  };
  const int extra = static_cast<int>(std::min<std::int64_t>(std::max(threads, 1), tasks)) - 1;
  std::vector<std::thread> pool;
  for (int k = 0; k < extra; ++k) {
    pool.emplace_back(work);
  }
  work();
  for (std::thread& thread : pool) {
    thread.join();
  }
  if (failure) {
    std::rethrow_exception(failure);
  }
}

} // namespace driftwalk
