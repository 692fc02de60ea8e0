// The KS statistic behind its public header: prepares the points and runs the sweep of the chosen
// instruction set.
#include "driftwalk/dispatch.hpp"
#include "driftwalk/stats/ks2d.hpp"
#include "driftwalk/stats/ks2d_order.hpp"
#include "driftwalk/stats/ks2d_permutation.hpp"
#include "driftwalk/stats/ks2d_sweep.hpp"

#include <cmath>
#include <limits>
#include <numeric>

namespace driftwalk {
namespace {

void sweep_with(InstructionSet set, const KsSweep& sweep, KsBest best[2]) {
#if defined(DRIFTWALK_X86_LANES)
  if (set == InstructionSet::avx512) {
    return ks_sweep_avx512(sweep, best);
  }
  if (set == InstructionSet::avx2) {
    return ks_sweep_avx2(sweep, best);
  }
#endif
  (void)set;
  ks_sweep_baseline(sweep, best);
}

bool bounded_with(InstructionSet set, const KsPlain& samples, KsFound found[2],
                  std::int64_t& tied) {
#if defined(DRIFTWALK_X86_LANES)
  if (set == InstructionSet::avx512) {
    return ks_bounded_avx512(samples, found, tied);
  }
  if (set == InstructionSet::avx2) {
    return ks_bounded_avx2(samples, found, tied);
  }
#endif
  (void)set;
  return ks_bounded_baseline(samples, found, tied);
}

constexpr std::int64_t alignment = 64;

} // namespace

std::int64_t ks_scratch_bytes(std::int64_t n) {
  // Per point: its place in a block of x and two weights; at most 2 and 16 bytes. Per block of at
  // least 128: a counter and three weights. The rest is padding and the arrays of one block.
  return 18 * n + 36 * (n / 128) + 512 * 1024;
}

struct KsReference::Data {
  KsSortedSample sorted;
  std::vector<double> x;
  std::vector<double> y;
  bool is_tied() const { return sorted.x.tied || sorted.y.tied; }
};

struct KsWorkspace::Data {
  KsSortScratch sort;
  KsSortedSample sorted;
  KsReference first; // where sample 1 comes unprepared
  KsGeometry geometry;
  KsTiedWeights tied;
  std::vector<unsigned char> scratch;

  void* aligned_scratch(std::int64_t bytes) {
    ks_grow(scratch, bytes + alignment);
    const std::uintptr_t begin = reinterpret_cast<std::uintptr_t>(scratch.data());
    return scratch.data() + (alignment - begin % alignment) % alignment;
  }

  // Run the sweep over the geometry with its labels.
  void sweep(std::int64_t n1, std::int64_t n2, KsTies ties, InstructionSet set, KsBest best[2]) {
    const std::int64_t common = std::gcd(n1, n2);
    KsSweep job{};
    job.n = geometry.n;
    job.x_position = geometry.x_position.data();
    job.second_by_x = geometry.second_by_x.data();
    job.second_by_y = geometry.second_by_y.data();
    job.weight[0] = n2 / common;
    job.weight[1] = -(n1 / common);
    job.total = n1 * job.weight[0];
    job.limits = ties == KsTies::limits;
    if (geometry.tied > 0) {
      ks_tied_weights(geometry, job.second_by_x, job.weight, tied);
      job.tied_in_x = tied.in_x.data();
      job.tied_in_y = tied.in_y.data();
    }
    job.scratch = aligned_scratch(ks_scratch_bytes(geometry.n));
    sweep_with(set, job, best);
    best[0].value *= common;
    best[1].value *= common;
  }
};

double KsResult::distance1() const {
  return n1 > 0 && n2 > 0 ? double(d1) / (double(n1) * double(n2))
                          : std::numeric_limits<double>::quiet_NaN();
}
double KsResult::distance2() const {
  return n1 > 0 && n2 > 0 ? double(d2) / (double(n1) * double(n2))
                          : std::numeric_limits<double>::quiet_NaN();
}
double KsResult::distance() const {
  return n1 > 0 && n2 > 0 ? double(d1 + d2) / (2.0 * double(n1) * double(n2))
                          : std::numeric_limits<double>::quiet_NaN();
}
const KsPlace& KsResult::place() const {
  return d1 >= d2 ? place1 : place2;
}

std::int64_t first_not_finite(const double* x, const double* y, std::int64_t n) {
  for (std::int64_t i = 0; i < n; ++i) {
    if (!std::isfinite(x[i]) || !std::isfinite(y[i])) {
      return i;
    }
  }
  return -1;
}

KsReference::KsReference() : data_(std::make_unique<Data>()) {}
KsReference::KsReference(const double* x, const double* y, std::int64_t n) : KsReference() {
  KsWorkspace workspace;
  assign(x, y, n, workspace);
}
void KsReference::assign(const double* x, const double* y, std::int64_t n, KsWorkspace& workspace) {
  ks_sort(x, y, n, workspace.data().sort, data_->sorted);
  data_->x.assign(x, x + n);
  data_->y.assign(y, y + n);
}
KsReference::~KsReference() = default;
KsReference::KsReference(KsReference&&) noexcept = default;
KsReference& KsReference::operator=(KsReference&&) noexcept = default;
std::int64_t KsReference::size() const {
  return data_->sorted.n;
}

KsWorkspace::KsWorkspace() : data_(std::make_unique<Data>()) {}
KsWorkspace::~KsWorkspace() = default;
KsWorkspace::KsWorkspace(KsWorkspace&&) noexcept = default;
KsWorkspace& KsWorkspace::operator=(KsWorkspace&&) noexcept = default;

namespace {

// The statistic between two sorted samples; x2 and y2 are the points of the second.
KsResult compare_sorted(const KsReference::Data& first, const KsSortedSample& second,
                        const double* x2, const double* y2, KsWorkspace::Data& work, KsTies ties) {
  KsResult result;
  result.n1 = first.sorted.n;
  result.n2 = second.n;
  ks_geometry(first.sorted, second, work.geometry);
  result.tied = work.geometry.tied;
  KsBest best[2];
  work.sweep(result.n1, result.n2, ties, chosen_instruction_set(), best);
  result.d1 = best[0].value;
  result.d2 = best[1].value;
  if (best[0].position >= 0) {
    const std::int64_t i = ks_row(first.sorted, second, work.geometry, best[0].position);
    result.place1 = {first.x[i], first.y[i], best[0].quadrant, i};
  }
  if (best[1].position >= 0) {
    const std::int64_t i = ks_row(first.sorted, second, work.geometry, best[1].position);
    result.place2 = {x2[i], y2[i], best[1].quadrant, i};
  }
  return result;
}

// The same of two samples as they come; false where it has to be found by the sorted way.
bool compare_plain(const double* x1, const double* y1, std::int64_t n1, const double* x2,
                   const double* y2, std::int64_t n2, KsWorkspace::Data& work, KsTies ties,
                   KsResult& result, std::int64_t most_tied = ks_every_tie) {
  if (ties != KsTies::strict || n1 + n2 < ks_bounded_from || n1 + n2 > ks_bounded_to) {
    return false;
  }
  const std::int64_t common = std::gcd(n1, n2);
  const KsPlain samples{{x1, x2},           {y1, y2},
                        {n1, n2},           {n2 / common, -(n1 / common)},
                        n1 * (n2 / common), ks_bucket_sizes(n1 + n2),
                        most_tied,          work.aligned_scratch(ks_bounded_bytes(n1 + n2))};
  KsFound found[2];
  result.n1 = n1;
  result.n2 = n2;
  if (!bounded_with(chosen_instruction_set(), samples, found, result.tied)) {
    return false;
  }
  result.d1 = found[0].value * common;
  result.d2 = found[1].value * common;
  if (found[0].row >= 0) {
    result.place1 = {x1[found[0].row], y1[found[0].row], found[0].quadrant, found[0].row};
  }
  if (found[1].row >= 0) {
    result.place2 = {x2[found[1].row], y2[found[1].row], found[1].quadrant, found[1].row};
  }
  return true;
}

KsResult without_points(std::int64_t n1, std::int64_t n2) {
  KsResult result;
  result.n1 = n1;
  result.n2 = n2;
  return result;
}

} // namespace

KsResult ks_two_sample(const KsReference& reference, const double* x2, const double* y2,
                       std::int64_t n2, KsWorkspace& workspace, KsTies ties,
                       std::int64_t most_tied) {
  if (reference.size() == 0 || n2 == 0) {
    return without_points(reference.size(), n2);
  }
  KsWorkspace::Data& work = workspace.data();
  const KsReference::Data& first = reference.data();
  KsResult result;
  if (compare_plain(first.x.data(), first.y.data(), first.sorted.n, x2, y2, n2, work, ties, result,
                    most_tied)) {
    return result;
  }
  ks_sort(x2, y2, n2, work.sort, work.sorted);
  return compare_sorted(first, work.sorted, x2, y2, work, ties);
}

KsResult ks_two_sample(const KsReference& first, const KsReference& second, KsWorkspace& workspace,
                       KsTies ties) {
  if (first.size() == 0 || second.size() == 0) {
    return without_points(first.size(), second.size());
  }
  const KsReference::Data& one = first.data();
  const KsReference::Data& other = second.data();
  KsWorkspace::Data& work = workspace.data();
  KsResult result;
  // Of sorted samples without ties the sweep takes no longer.
  if ((one.is_tied() || other.is_tied()) &&
      compare_plain(one.x.data(), one.y.data(), one.sorted.n, other.x.data(), other.y.data(),
                    other.sorted.n, work, ties, result)) {
    return result;
  }
  return compare_sorted(one, other.sorted, other.x.data(), other.y.data(), work, ties);
}

KsResult ks_two_sample(const double* x1, const double* y1, std::int64_t n1, const double* x2,
                       const double* y2, std::int64_t n2, KsWorkspace& workspace, KsTies ties,
                       std::int64_t most_tied) {
  if (n1 == 0 || n2 == 0) {
    return without_points(n1, n2);
  }
  KsWorkspace::Data& work = workspace.data();
  KsResult result;
  if (compare_plain(x1, y1, n1, x2, y2, n2, work, ties, result, most_tied)) {
    return result;
  }
  work.first.assign(x1, y1, n1, workspace);
  ks_sort(x2, y2, n2, work.sort, work.sorted);
  return compare_sorted(work.first.data(), work.sorted, x2, y2, work, ties);
}

std::optional<KsResult> ks_by_bounds(const double* x1, const double* y1, std::int64_t n1,
                                     const double* x2, const double* y2, std::int64_t n2,
                                     KsWorkspace& workspace) {
  KsResult result;
  if (n1 == 0 || n2 == 0 ||
      !compare_plain(x1, y1, n1, x2, y2, n2, workspace.data(), KsTies::strict, result, 0)) {
    return std::nullopt;
  }
  return result;
}

KsPeacock ks_peacock(const KsReference& reference, const double* x2, const double* y2,
                     std::int64_t n2, KsWorkspace& workspace) {
  const KsReference::Data& first = reference.data();
  KsWorkspace::Data& work = workspace.data();
  const std::int64_t n1 = first.sorted.n;
  KsPeacock result;
  if (n1 == 0 || n2 == 0) {
    return result;
  }
  ks_sort(x2, y2, n2, work.sort, work.sorted);
  ks_geometry(first.sorted, work.sorted, work.geometry);
  const std::int64_t common = std::gcd(n1, n2);
  const std::int64_t weight[2] = {n2 / common, -(n1 / common)};
  const KsCut cut = ks_largest_cut(work.geometry, weight, n1 * weight[0]);
  result.d = cut.value * common;
  result.tied = work.geometry.tied;
  if (cut.position >= 0) {
    const KsGeometry& g = work.geometry;
    const auto coordinate = [&](const std::vector<double>& a, const double* b, std::int64_t at) {
      const std::int64_t row = ks_row(first.sorted, work.sorted, g, at);
      return g.second_by_x[at] != 0 ? b[row] : a[row];
    };
    result.place = {coordinate(first.x, x2, cut.position),
                    coordinate(first.y, y2, g.x_position[cut.y_position]), cut.quadrant, -1};
  }
  return result;
}

void ks_permutations(const double* x, const double* y, std::int64_t n1, std::int64_t n2,
                     const std::int32_t* block_of, std::int64_t blocks, const std::uint8_t* labels,
                     std::int64_t permutations, KsTies ties, std::int64_t* statistic) {
  const KsReference reference(x, y, n1);
  KsWorkspace workspace;
  KsWorkspace::Data& work = workspace.data();
  ks_sort(x + n1, y + n1, n2, work.sort, work.sorted);
  KsGeometry& g = work.geometry;
  ks_geometry(reference.data().sorted, work.sorted, g);
  if (g.tied == 0) {
    ks_points(reference.data().sorted, work.sorted, g);
  }
  std::vector<std::int32_t> block_by_x(static_cast<std::size_t>(g.n));
  for (std::int64_t k = 0; k < g.n; ++k) {
    block_by_x[k] = block_of[g.point[k]];
  }
  const InstructionSet set = chosen_instruction_set();
  for (std::int64_t p = 0; p < permutations; ++p) {
    const std::uint8_t* const label = labels + p * blocks;
    for (std::int64_t k = 0; k < g.n; ++k) {
      g.second_by_x[k] = label[block_by_x[k]];
    }
    for (std::int64_t k = 0; k < g.n; ++k) {
      g.second_by_y[k] = g.second_by_x[g.x_position[k]];
    }
    KsBest best[2];
    work.sweep(n1, n2, ties, set, best);
    statistic[p] = best[0].value + best[1].value;
  }
}

} // namespace driftwalk
