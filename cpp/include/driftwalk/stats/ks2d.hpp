// The two-sample, two-dimensional Kolmogorov-Smirnov statistic of Fasano and Franceschini.
//
// For every point of sample 1 as origin (X, Y) the plane falls into four quadrants; D1 is the
// largest absolute difference, over origins and quadrants, of the fractions of sample 1 and of
// sample 2 in a quadrant; D2 the same with the points of sample 2 as origins; D = (D1 + D2) / 2.
// Everything stays an integer, max |n2 c1 - n1 c2|, until the last division.
//
// The fixed sample is prepared once (KsReference, shared by all threads); each thread owns a
// KsWorkspace, which grows and never shrinks, so that a call allocates nothing once it is warm.
// Coordinates must be finite (first_not_finite tells); -0.0 equals +0.0.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>

namespace driftwalk {

// What happens to a point that shares a coordinate with the origin.
enum class KsTies {
  strict, // it lies in no quadrant: the quadrants are open
  limits, // the largest difference over the open and closed choices of each axis
};

// Quadrants seen from the origin: 0 left below, 1 right below, 2 left above, 3 right above.
struct KsPlace {
  double x = 0;
  double y = 0;
  std::int32_t quadrant = -1; // -1: the difference is zero everywhere
  std::int64_t index = -1;    // of the origin in its own sample
};

struct KsResult {
  std::int64_t d1 = 0; // D1 n1 n2
  std::int64_t d2 = 0; // D2 n1 n2
  std::int64_t n1 = 0;
  std::int64_t n2 = 0;
  std::int64_t tied = 0; // points of both samples that share a coordinate with another
  KsPlace place1;        // where D1 sits: its origin is a point of sample 1
  KsPlace place2;        // where D2 sits: its origin is a point of sample 2

  double distance() const;      // (D1 + D2) / 2; NaN when a sample is empty
  double distance1() const;     // D1
  double distance2() const;     // D2
  const KsPlace& place() const; // of the larger of the two, of D1 when they are equal
};

// Index of the first point with a coordinate that is not finite, or -1.
std::int64_t first_not_finite(const double* x, const double* y, std::int64_t n);

class KsWorkspace;

// The fixed sample, sorted on both axes. Once made, any number of threads may share it.
class KsReference {
public:
  KsReference(); // an empty sample
  KsReference(const double* x, const double* y, std::int64_t n);
  ~KsReference();
  KsReference(KsReference&&) noexcept;
  KsReference& operator=(KsReference&&) noexcept;

  // Take another sample and keep the memory.
  void assign(const double* x, const double* y, std::int64_t n, KsWorkspace& workspace);
  std::int64_t size() const;

  struct Data;
  const Data& data() const { return *data_; }

private:
  std::unique_ptr<Data> data_;
};

// Scratch memory of one thread.
class KsWorkspace {
public:
  KsWorkspace();
  ~KsWorkspace();
  KsWorkspace(KsWorkspace&&) noexcept;
  KsWorkspace& operator=(KsWorkspace&&) noexcept;

  struct Data;
  Data& data() { return *data_; }

private:
  std::unique_ptr<Data> data_;
};

// As `most_tied` below: all tied points are counted. Fewer take less time, none the least.
constexpr std::int64_t ks_every_tie = std::numeric_limits<std::int64_t>::max();

// The statistic between the reference (sample 1) and the points (x2, y2) (sample 2). The number of
// tied points is right up to `most_tied`; beyond it is at least one more. With 0 it may be 0.
KsResult ks_two_sample(const KsReference& reference, const double* x2, const double* y2,
                       std::int64_t n2, KsWorkspace& workspace, KsTies ties = KsTies::strict,
                       std::int64_t most_tied = ks_every_tie);

// The same where both samples are prepared: a sample that is met many times is sorted once.
KsResult ks_two_sample(const KsReference& first, const KsReference& second, KsWorkspace& workspace,
                       KsTies ties = KsTies::strict);

// The same where neither is: nothing is sorted in most cases.
KsResult ks_two_sample(const double* x1, const double* y1, std::int64_t n1, const double* x2,
                       const double* y2, std::int64_t n2, KsWorkspace& workspace,
                       KsTies ties = KsTies::strict, std::int64_t most_tied = ks_every_tie);

// The statistic alone, without the count of tied points. Nothing where the samples are small, or
// lie so that sorted ones take less time: see the call above.
std::optional<KsResult> ks_by_bounds(const double* x1, const double* y1, std::int64_t n1,
                                     const double* x2, const double* y2, std::int64_t n2,
                                     KsWorkspace& workspace);

// Peacock's statistic: the largest difference over every cut of the plane, not only over cuts at a
// point. A cut at (X, Y) parts {x <= X} from {x > X} and {y <= Y} from {y > Y}.
struct KsPeacock {
  std::int64_t d = 0;    // D n1 n2
  std::int64_t tied = 0; // points of both samples that share a coordinate with another
  KsPlace place;         // of the cut; it belongs to no sample, so the index stays -1
};
KsPeacock ks_peacock(const KsReference& reference, const double* x2, const double* y2,
                     std::int64_t n2, KsWorkspace& workspace);

} // namespace driftwalk
