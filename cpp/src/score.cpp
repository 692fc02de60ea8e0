// Worlds are scored as they finish: their trajectories live in a thread's scratch and go no
// further.
#include "driftwalk/simulate/lanes.hpp"
#include "driftwalk/simulate/simulate.hpp"
#include "driftwalk/simulate/threads.hpp"
#include "driftwalk/stats/steps.hpp"

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
      const KsResult result =
          ks_two_sample(*scoring_.reference, length_.data(), angle_.data(), pairs, workspace_);
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

// Rows first .. first + count - 1 of a table, sorted for comparison.
std::vector<KsReference> prepare_rows(const StepTable& table, std::int64_t first,
                                      std::int64_t count, int threads) {
  std::vector<KsReference> rows(static_cast<std::size_t>(count));
  run_tasks(count, threads, [&] {
    return [&, workspace = KsWorkspace()](std::int64_t row) mutable {
      const std::int64_t at = (first + row) * table.stride;
      rows[static_cast<std::size_t>(row)].assign(table.length + at, table.angle + at,
                                                 table.count[first + row], workspace);
    };
  });
  return rows;
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
  // Prepared samples take some 40 bytes a step: a block of them at a time bounds the memory.
  constexpr std::int64_t block = 64;
  const std::vector<KsReference> rows = prepare_rows(references, 0, references.rows, threads);
  for (std::int64_t first = 0; first < samples.rows; first += block) {
    const std::int64_t width = std::min(block, samples.rows - first);
    const std::vector<KsReference> columns = prepare_rows(samples, first, width, threads);
    run_tasks(references.rows * width, threads, [&] {
      return [&, workspace = KsWorkspace()](std::int64_t task) mutable {
        const std::int64_t row = task / width, column = task % width;
        const KsReference& a = rows[static_cast<std::size_t>(row)];
        const KsReference& b = columns[static_cast<std::size_t>(column)];
        out[row * samples.rows + first + column] =
            a.size() == 0 || b.size() == 0 ? 1.0 : ks_two_sample(a, b, workspace).distance();
      };
    });
  }
}

} // namespace driftwalk
