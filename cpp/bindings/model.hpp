// What the bindings share: arrays through one checked door, and the prepared model.
#pragma once

#include "driftwalk/simulate/prepare.hpp"

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace nb = nanobind;

template <class T, int Dimensions>
using In = nb::ndarray<const T, nb::ndim<Dimensions>, nb::c_contig, nb::device::cpu>;
template <class T>
using Out = nb::ndarray<nb::numpy, T>;

template <class T>
Out<T> hand_out(std::vector<T>&& values, std::vector<std::size_t> shape) {
  auto* const owned = new std::vector<T>(std::move(values));
  nb::capsule owner(owned, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
  return Out<T>(owned->data(), shape.size(), shape.data(), owner);
}

// The numbers of a model from keyword arguments: each exactly once, and no others.
inline driftwalk::ModelNumbers numbers_of(const nb::kwargs& given) {
  driftwalk::ModelNumbers numbers;
  std::string known;
  std::size_t found = 0;
  driftwalk::each_model_number([&](const char* name, const char*, driftwalk::Range, auto field) {
    if (!given.contains(name) || !nb::try_cast(given[name], numbers.*field)) {
      throw nb::type_error((std::string(name) + " is missing or not a number").c_str());
    }
    known += std::string(known.empty() ? "" : ", ") + name;
    ++found;
  });
  if (given.size() != found) {
    throw nb::type_error(("a model has no other numbers than " + known).c_str());
  }
  driftwalk::check_model_numbers(numbers);
  return numbers;
}

struct ModelArrays {
  In<double, 2> edges;
  In<double, 3> u, v;
  In<double, 1> frame_time, sample_time;
  In<double, 2> view_edges;
  driftwalk::FlowRepeat repeat;
  std::optional<In<double, 2>> panels, corners, moment_points; // of a body that is no block
};

inline driftwalk::FlowRepeat repeat_of(const std::string& name) {
  if (name == "hold") {
    return driftwalk::FlowRepeat::hold;
  }
  if (name == "loop") {
    return driftwalk::FlowRepeat::loop;
  }
  if (name == "mirror") {
    return driftwalk::FlowRepeat::mirror;
  }
  throw std::invalid_argument("flow_repeat is hold, loop or mirror, got " + name);
}

// Times on the clock of a flow's frames at which worlds begin, null where none are given.
inline const double* starts_of(const std::optional<In<double, 1>>& start, std::size_t worlds) {
  if (!start) {
    return nullptr;
  }
  if (start->size() != worlds) {
    throw std::invalid_argument("flow_start must have one entry per world");
  }
  return start->data();
}

inline void check(const ModelArrays& arrays) {
  const auto& u = arrays.u;
  const auto& v = arrays.v;
  if (arrays.edges.shape(1) != 3 || arrays.view_edges.shape(1) != 3) {
    throw std::invalid_argument("edges and view_edges must have shape (n, 3)");
  }
  if (u.size() == 0 || u.shape(0) != v.shape(0) || u.shape(1) != v.shape(1) ||
      u.shape(2) != v.shape(2) || arrays.frame_time.size() != u.shape(0)) {
    throw std::invalid_argument("u and v must have the same shape (frames, rows, columns), and "
                                "frame_time one time per frame");
  }
  if (arrays.panels.has_value() != arrays.corners.has_value() ||
      arrays.panels.has_value() != arrays.moment_points.has_value()) {
    throw std::invalid_argument("panels, corners and moment_points go together");
  }
  if (arrays.panels && (arrays.panels->shape(0) == 0 || arrays.panels->shape(1) != 5 ||
                        arrays.corners->shape(1) != 2 || arrays.moment_points->shape(0) == 0 ||
                        arrays.moment_points->shape(1) != 3)) {
    throw std::invalid_argument(
        "panels must have shape (n, 5), corners (n, 2) and moment_points (n, 3)");
  }
  if (arrays.sample_time.size() == 0) {
    throw std::invalid_argument("a model has at least one sample");
  }
}

// A model, prepared for both number types.
class Model {
public:
  Model(const driftwalk::ModelNumbers& numbers, const ModelArrays& arrays) : numbers_(numbers) {
    check(arrays);
    driftwalk::BatchModel model{numbers};
    model.edges = arrays.edges.data();
    model.edge_count = static_cast<int>(arrays.edges.shape(0));
    model.view_edges = arrays.view_edges.data();
    model.view_edge_count = static_cast<int>(arrays.view_edges.shape(0));
    if (arrays.panels) {
      model.panels = arrays.panels->data();
      model.panel_count = static_cast<int>(arrays.panels->shape(0));
      model.corners = arrays.corners->data();
      model.corner_count = static_cast<int>(arrays.corners->shape(0));
      model.moment_points = arrays.moment_points->data();
      model.moment_point_count = static_cast<int>(arrays.moment_points->shape(0));
    }
    model.flow_u = arrays.u.data();
    model.flow_v = arrays.v.data();
    model.frames = static_cast<int>(arrays.u.shape(0));
    model.rows = static_cast<int>(arrays.u.shape(1));
    model.columns = static_cast<int>(arrays.u.shape(2));
    model.frame_time = arrays.frame_time.data();
    model.repeat = arrays.repeat;
    model.sample_time = arrays.sample_time.data();
    model.samples = static_cast<std::int64_t>(arrays.sample_time.size());
    single_.emplace(model);
    twice_.emplace(model);
  }

  const driftwalk::ModelNumbers& numbers() const { return numbers_; }
  std::int64_t samples() const { return twice().view().samples; }
  const driftwalk::PreparedRun<float>& single() const { return *single_; }
  const driftwalk::PreparedRun<double>& twice() const { return *twice_; }

private:
  driftwalk::ModelNumbers numbers_;
  std::optional<driftwalk::PreparedRun<float>> single_;
  std::optional<driftwalk::PreparedRun<double>> twice_;
};
