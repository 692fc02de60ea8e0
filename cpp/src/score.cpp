// Worlds are scored as they finish: their trajectories live in a thread's scratch and go no
// further.
#include "driftwalk/simulate/lanes.hpp"
#include "driftwalk/simulate/simulate.hpp"
#include "driftwalk/simulate/threads.hpp"
#include "driftwalk/stats/steps.hpp"

#include <memory>
#include <mutex>
#include <optional>

namespace driftwalk {

namespace {

void bin_steps(const Scoring& scoring, const double* length, const double* angle,
               std::int64_t pairs, float* density) {
  const std::int64_t cells = std::int64_t(scoring.length_bins) * scoring.angle_bins;
  std::fill(density, density + cells, 0.0f);
  for (std::int64_t k = 0; k < pairs; ++k) {
    const double across = length[k] / scoring.length_limit * scoring.length_bins;
    const double around = (angle[k] / scoring.angle_limit + 1) * 0.5 * scoring.angle_bins;
    const int row = static_cast<int>(std::min(across, scoring.length_bins - 1.0));
    const int column = static_cast<int>(std::clamp(around, 0.0, scoring.angle_bins - 1.0));
    density[row * scoring.angle_bins + column] += 1.0f;
  }
  for (std::int64_t k = 0; k < cells && pairs > 0; ++k) {
    density[k] /= static_cast<float>(pairs);
  }
}

// One thread's scratch and what it does with the worlds of a call.
class Scorer {
public:
  Scorer(const PreparedRun<float>& run, const BatchWorlds& worlds, const Scoring& scoring,
         const Scores& out, const SimulateKernel& kernel, const WorldCalls& calls)
      : run_(run), worlds_(worlds), scoring_(scoring), out_(out), kernel_(kernel), calls_(calls),
        // A whole number of cache lines plus one, so that lanes do not share cache sets.
        stride_((run.view().samples / 16 + 2) * 16),
        x_(static_cast<std::size_t>(stride_ * calls.most())), y_(x_.size()),
        length_(static_cast<std::size_t>(scoring.plan.pairs)), angle_(length_.size()) {}

  void operator()(std::int64_t call) {
    const std::int64_t first = calls_.first(call);
    const int count = calls_.size(call);
    const SampleSink<float> sink{x_.data(), y_.data(), nullptr, stride_};
    kernel_.run(run_.view(), worlds_, first, count, sink, out_.status + first);
    for (int lane = 0; lane < count; ++lane) {
      score(first + lane, x_.data() + lane * stride_, y_.data() + lane * stride_);
    }
  }

private:
  void score(std::int64_t world, const float* x, const float* y) {
    const std::int64_t pairs =
        apply_step_plan(scoring_.plan, x, y, length_.data(), angle_.data(), nullptr);
    out_.pairs[world] = pairs;
    if (out_.density != nullptr) {
      const std::int64_t cells = std::int64_t(scoring_.length_bins) * scoring_.angle_bins;
      bin_steps(scoring_, length_.data(), angle_.data(), pairs, out_.density + world * cells);
    }
    if (out_.excerpt_x != nullptr) {
      std::copy(x, x + scoring_.excerpt, out_.excerpt_x + world * scoring_.excerpt);
      std::copy(y, y + scoring_.excerpt, out_.excerpt_y + world * scoring_.excerpt);
    }
    if (out_.length != nullptr) {
      const std::int64_t at = world * scoring_.plan.pairs;
      std::copy_n(length_.data(), pairs, out_.length + at);
      std::copy_n(angle_.data(), pairs, out_.angle + at);
    }
    if (out_.distance != nullptr) {
      write_distance(world, pairs);
    }
  }

  // A world without motion, or without steps, is as far from the recording as can be.
  void write_distance(std::int64_t world, std::int64_t pairs) {
    KsPlace place;
    double distance = 1;
    if (pairs > 0 && out_.status[world] == status_ok) {
      const KsResult result = ks_two_sample(*scoring_.reference, length_.data(), angle_.data(),
                                            pairs, workspace_, KsTies::strict, 0);
      distance = result.distance();
      place = result.place();
    }
    out_.distance[world] = distance;
    out_.place_length[world] = place.x;
    out_.place_angle[world] = place.y;
    out_.place_quadrant[world] = place.quadrant;
  }

  const PreparedRun<float>& run_;
  const BatchWorlds& worlds_;
  const Scoring& scoring_;
  const Scores& out_;
  const SimulateKernel kernel_;
  const WorldCalls& calls_;
  std::int64_t stride_;
  std::vector<float> x_, y_;
  std::vector<double> length_, angle_;
  KsWorkspace workspace_;
};

// The rows of a table, sorted when that is first needed: most comparisons do without.
class SortedRows {
public:
  explicit SortedRows(const StepTable& table)
      : table_(table), rows_(static_cast<std::size_t>(table.rows)),
        sorted_(std::make_unique<std::once_flag[]>(rows_.size())) {}

  std::int64_t size(std::int64_t row) const { return table_.count[row]; }
  const double* length(std::int64_t row) const { return table_.length + row * table_.stride; }
  const double* angle(std::int64_t row) const { return table_.angle + row * table_.stride; }
  const KsReference& sorted(std::int64_t row, KsWorkspace& workspace) {
    KsReference& found = rows_[static_cast<std::size_t>(row)];
    std::call_once(sorted_[static_cast<std::size_t>(row)],
                   [&] { found.assign(length(row), angle(row), size(row), workspace); });
    return found;
  }

private:
  const StepTable& table_;
  std::vector<KsReference> rows_;
  std::unique_ptr<std::once_flag[]> sorted_;
};

double distance_of(SortedRows& a, std::int64_t i, SortedRows& b, std::int64_t j,
                   KsWorkspace& workspace) {
  if (a.size(i) == 0 || b.size(j) == 0) {
    return 1.0;
  }
  const std::optional<KsResult> found = ks_by_bounds(a.length(i), a.angle(i), a.size(i),
                                                     b.length(j), b.angle(j), b.size(j), workspace);
  return found
             ? found->distance()
             : ks_two_sample(a.sorted(i, workspace), b.sorted(j, workspace), workspace).distance();
}

} // namespace

void score_batch(const PreparedRun<float>& run, const BatchWorlds& worlds, const Scoring& scoring,
                 int threads, const Scores& out) {
  const SimulateKernel kernel = chosen_kernel();
  const WorldCalls calls(kernel, worlds.count, threads);
  run_tasks(calls.count(), threads,
            [&] { return Scorer(run, worlds, scoring, out, kernel, calls); });
}

void ks_matrix(const StepTable& references, const StepTable& samples, int threads, double* out) {
  SortedRows rows(references), columns(samples);
  run_tasks(references.rows * samples.rows, threads, [&] {
    return [&, workspace = KsWorkspace()](std::int64_t task) mutable {
      out[task] = distance_of(rows, task / samples.rows, columns, task % samples.rows, workspace);
    };
  });
}

} // namespace driftwalk
