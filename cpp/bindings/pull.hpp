// Tables of forces between blocks, kept for the kernel.
#pragma once

#include "model.hpp"

#include "driftwalk/assembly/pull_rules.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <vector>

class Pull {
public:
  Pull(double reach, double lever, In<double, 1> pole, bool like_poles_repel, int every,
       double near_fading, double near_end, double near_reach) {
    if (pole.size() != 4) {
      throw std::invalid_argument("a block has four poles");
    }
    rules_.on = true;
    rules_.reach = reach;
    rules_.lever = lever;
    rules_.like_poles_repel = like_poles_repel;
    rules_.every = every;
    rules_.near_fading = near_fading;
    rules_.near_end = near_end;
    rules_.near_reach = near_reach;
    for (std::size_t face = 0; face < 4; ++face) {
      rules_.pole[face] = pole.data()[face];
    }
  }

  // `what` is centres, resistance or faces; (value, slope) of each cell from the number `first` on.
  void set_radial(const std::string& what, In<double, 2> cells, int first) {
    if (cells.shape(0) < 1 || cells.shape(1) != 2) {
      throw std::invalid_argument("a radial table has two numbers per cell");
    }
    Radial& own = what == "centres" ? centres_ : what == "faces" ? faces_ : resistance_;
    own.twice.assign(cells.data(), cells.data() + cells.size());
    own.single.assign(cells.data(), cells.data() + cells.size());
    own.single.resize(cells.size() + 2); // two cells are read at once
    driftwalk::RadialTable& table = what == "centres" ? rules_.centres
                                    : what == "faces" ? rules_.faces
                                                      : rules_.resistance;
    table = {own.single.data(), own.twice.data(), static_cast<int>(cells.shape(0)), first};
  }

  // Coefficients on (distance, direction, angle).
  void set_oriented(In<double, 3> coefficient, double first, double per_step, double low,
                    double high) {
    if (coefficient.shape(1) < 3 || coefficient.shape(1) != coefficient.shape(2)) {
      throw std::invalid_argument("an oriented table has as many directions as angles");
    }
    oriented_.assign(coefficient.data(), coefficient.data() + coefficient.size());
    rules_.oriented = {oriented_.data(),
                       static_cast<int>(coefficient.shape(0)),
                       static_cast<int>(coefficient.shape(1)),
                       first,
                       per_step,
                       low,
                       high};
  }

  // Squares of lengths [m^2]; see `Multipoles`.
  void set_multipoles(In<double, 1> coefficient, double softening, double fading, double end) {
    driftwalk::Multipoles& far = rules_.multipoles;
    if (coefficient.size() != std::size(far.coefficient)) {
      throw std::invalid_argument("multipoles have six coefficients");
    }
    far = {.on = true, .softening = softening, .fading = fading, .end = end};
    std::copy_n(coefficient.data(), coefficient.size(), far.coefficient);
  }

  const driftwalk::PullRules& rules() const { return rules_; }

private:
  struct Radial {
    std::vector<float> single;
    std::vector<double> twice;
  };
  Radial centres_, faces_, resistance_;
  std::vector<float> oriented_;
  driftwalk::PullRules rules_;
};

inline void register_pull(nb::module_& module) {
  using namespace nb::literals;
  nb::class_<Pull>(module, "Pull")
      .def(nb::init<double, double, In<double, 1>, bool, int, double, double, double>(),
           nb::kw_only(), "reach"_a, "lever"_a, "pole"_a, "like_poles_repel"_a, "every"_a,
           "near_fading"_a, "near_end"_a, "near_reach"_a)
      .def("set_radial", &Pull::set_radial, "what"_a, "cells"_a, "first"_a)
      .def("set_oriented", &Pull::set_oriented, "coefficient"_a, nb::kw_only(), "first"_a,
           "per_step"_a, "low"_a, "high"_a)
      .def("set_multipoles", &Pull::set_multipoles, "coefficient"_a, nb::kw_only(), "softening"_a,
           "fading"_a, "end"_a);
}
