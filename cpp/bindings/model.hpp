// What the bindings share: arrays through one checked door, and the prepared model.
#pragma once

#include "driftwalk/simulate/prepare.hpp"

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <optional>
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

// A model with everything it points to, prepared for both number types.
class Model {
public:
  Model(driftwalk::BatchModel model, In<double, 2> edges, In<double, 3> u, In<double, 3> v,
        In<double, 1> frame_time, In<double, 1> sample_time,
        const std::optional<In<double, 2>>& view_edges)
      : samples_(model.samples = static_cast<std::int64_t>(sample_time.size())) {
    model.edges = edges.data();
    model.edge_count = static_cast<int>(edges.shape(0));
    if (view_edges) {
      model.view_edges = view_edges->data();
      model.view_edge_count = static_cast<int>(view_edges->shape(0));
    }
    model.flow_u = u.data();
    model.flow_v = v.data();
    model.frames = static_cast<int>(u.shape(0));
    model.rows = static_cast<int>(u.shape(1));
    model.columns = static_cast<int>(u.shape(2));
    model.frame_time = frame_time.data();
    model.sample_time = sample_time.data();
    single_.emplace(model);
    twice_.emplace(model);
  }

  std::int64_t samples() const { return samples_; }
  const driftwalk::PreparedRun<float>& single() const { return *single_; }
  const driftwalk::PreparedRun<double>& twice() const { return *twice_; }

private:
  std::int64_t samples_;
  std::optional<driftwalk::PreparedRun<float>> single_;
  std::optional<driftwalk::PreparedRun<double>> twice_;
};
