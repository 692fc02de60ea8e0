// Bindings of the step pairs: arrays in, arrays out.
#include "driftwalk/stats/steps.hpp"

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/tuple.h>

#include <cstdint>
#include <tuple>

namespace nb = nanobind;
using namespace nb::literals;

namespace {

template <class T>
using Row = nb::ndarray<const T, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
template <class T>
using NewRow = nb::ndarray<nb::numpy, T, nb::ndim<1>>;

template <class T>
T* new_row(std::size_t n, nb::capsule& owner) {
  T* const values = new T[n];
  owner = nb::capsule(values, [](void* p) noexcept { delete[] static_cast<T*>(p); });
  return values;
}

// (length, angle, index of the pair in the plan, left out for zero length, left out as missing)
using Steps =
    std::tuple<NewRow<double>, NewRow<double>, NewRow<std::int32_t>, std::int64_t, std::int64_t>;

template <class T>
Steps apply(const Row<std::int32_t>& left, const Row<double>& weight,
            const Row<std::int32_t>& triple, const Row<T>& x, const Row<T>& y) {
  const std::size_t pairs = triple.shape(0);
  nb::capsule length_owner;
  nb::capsule angle_owner;
  nb::capsule kept_owner;
  double* const length = new_row<double>(pairs, length_owner);
  double* const angle = new_row<double>(pairs, angle_owner);
  std::int32_t* const kept = new_row<std::int32_t>(pairs, kept_owner);
  std::int64_t zero = 0;
  std::int64_t missing = 0;
  const driftwalk::StepPlanView plan{left.data(), weight.data(), triple.data(),
                                     std::int64_t(left.shape(0)), std::int64_t(pairs)};
  std::size_t written = 0;
  {
    const nb::gil_scoped_release released;
    written = std::size_t(
        driftwalk::apply_step_plan(plan, x.data(), y.data(), length, angle, &zero, &missing, kept));
  }
  return {NewRow<double>(length, {written}, length_owner),
          NewRow<double>(angle, {written}, angle_owner),
          NewRow<std::int32_t>(kept, {written}, kept_owner), zero, missing};
}

} // namespace

void register_steps(nb::module_& module) {
  module.def("apply_step_plan", &apply<double>, "left"_a, "weight"_a, "triple"_a, "x"_a, "y"_a);
  module.def("apply_step_plan", &apply<float>, "left"_a, "weight"_a, "triple"_a, "x"_a, "y"_a);
}
