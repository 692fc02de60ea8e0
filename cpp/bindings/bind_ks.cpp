// Bindings of the KS statistic: arrays in, numbers out, the GIL released around the work.
#include "driftwalk/dispatch.hpp"
#include "driftwalk/stats/ks2d.hpp"
#include "driftwalk/stats/ks2d_permutation.hpp"

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/tuple.h>

#include <cstdint>
#include <tuple>
#include <vector>

namespace nb = nanobind;
using namespace nb::literals;
using namespace driftwalk;

namespace {

using Points = nb::ndarray<const double, nb::shape<-1, 2>, nb::c_contig, nb::device::cpu>;
template <class T>
using Row = nb::ndarray<const T, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
template <class T>
using Table = nb::ndarray<const T, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

// (x, y, quadrant, index)
using Place = std::tuple<double, double, std::int32_t, std::int64_t>;
// (D1 n1 n2, D2 n1 n2, n1, n2, points that tie, place of D1, place of D2)
using Result =
    std::tuple<std::int64_t, std::int64_t, std::int64_t, std::int64_t, std::int64_t, Place, Place>;

struct Columns {
  std::vector<double> x;
  std::vector<double> y;

  explicit Columns(const Points& points) { assign(points); }
  Columns() = default;

  void assign(const Points& points) {
    const std::size_t n = points.shape(0);
    x.resize(n);
    y.resize(n);
    const double* const from = points.data();
    for (std::size_t i = 0; i < n; ++i) {
      x[i] = from[2 * i];
      y[i] = from[2 * i + 1];
    }
  }
  std::int64_t size() const { return std::int64_t(x.size()); }
};

// What a thread keeps between calls, so that a call allocates nothing once it is warm.
struct Scratch {
  KsWorkspace workspace;
  Columns first;
  Columns columns;
};
Scratch& scratch() {
  thread_local Scratch of_this_thread;
  return of_this_thread;
}

Place place_of(const KsPlace& place) {
  return {place.x, place.y, place.quadrant, place.index};
}

Result result_of(const KsResult& r) {
  return {r.d1, r.d2, r.n1, r.n2, r.tied, place_of(r.place1), place_of(r.place2)};
}

Result compare(const KsReference& reference, const Points& points, bool limits,
               std::int64_t most_tied) {
  const nb::gil_scoped_release released;
  Scratch& own = scratch();
  own.columns.assign(points);
  return result_of(ks_two_sample(reference, own.columns.x.data(), own.columns.y.data(),
                                 own.columns.size(), own.workspace,
                                 limits ? KsTies::limits : KsTies::strict, most_tied));
}

Result compare_once(const Points& a, const Points& b, bool limits, std::int64_t most_tied) {
  const nb::gil_scoped_release released;
  Scratch& own = scratch();
  own.first.assign(a);
  own.columns.assign(b);
  return result_of(ks_two_sample(own.first.x.data(), own.first.y.data(), own.first.size(),
                                 own.columns.x.data(), own.columns.y.data(), own.columns.size(),
                                 own.workspace, limits ? KsTies::limits : KsTies::strict,
                                 most_tied));
}

// (D n1 n2, points that tie, place)
std::tuple<std::int64_t, std::int64_t, Place> peacock(const KsReference& reference,
                                                      const Points& points) {
  const nb::gil_scoped_release released;
  Scratch& own = scratch();
  own.columns.assign(points);
  const KsPeacock r = ks_peacock(reference, own.columns.x.data(), own.columns.y.data(),
                                 own.columns.size(), own.workspace);
  return {r.d, r.tied, place_of(r.place)};
}

nb::ndarray<nb::numpy, std::int64_t, nb::ndim<1>> permute(const Points& pooled, std::int64_t n1,
                                                          const Row<std::int32_t>& block_of,
                                                          const Table<std::uint8_t>& labels,
                                                          bool limits) {
  const std::size_t count = labels.shape(0);
  auto* const statistic = new std::int64_t[count];
  nb::capsule owner(statistic, [](void* p) noexcept { delete[] static_cast<std::int64_t*>(p); });
  {
    const nb::gil_scoped_release released;
    const Columns columns(pooled);
    ks_permutations(columns.x.data(), columns.y.data(), n1, columns.size() - n1, block_of.data(),
                    std::int64_t(labels.shape(1)), labels.data(), std::int64_t(count),
                    limits ? KsTies::limits : KsTies::strict, statistic);
  }
  return nb::ndarray<nb::numpy, std::int64_t, nb::ndim<1>>(statistic, {count}, owner);
}

} // namespace

void register_ks(nb::module_& module) {
  nb::class_<KsReference>(module, "KsReference")
      .def(
          "__init__",
          [](KsReference* self, const Points& points) {
            const Columns columns(points);
            new (self) KsReference(columns.x.data(), columns.y.data(), columns.size());
          },
          "points"_a)
      .def_prop_ro("size", &KsReference::size)
      .def("compare", &compare, "points"_a, "limits"_a, "most_tied"_a = ks_every_tie)
      .def("peacock", &peacock, "points"_a);
  module.def("ks_compare", &compare_once, "a"_a, "b"_a, "limits"_a, "most_tied"_a = ks_every_tie);
  module.def("ks_permutations", &permute, "pooled"_a, "n1"_a, "block_of"_a, "labels"_a, "limits"_a);
}
