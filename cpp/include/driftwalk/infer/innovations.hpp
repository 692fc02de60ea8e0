// The innovations of a track under a flow, a drag coefficient and a noise: what the likelihood fit
// is made of.
#pragma once

#include "driftwalk/infer/problem.hpp"

#include <array>
#include <vector>

namespace driftwalk {

struct FloatingBlock {
  double side;          // [m]
  double mass;          // [kg]
  double depth;         // of the wetted sides [m]
  int strips;           // a side
  double water_density; // [kg/m^3]
};

// A block in a spline flow. Copies the coefficients.
class DragModel {
public:
  // `flow.nodes` is not read; coefficients are [2][rows][columns], of u and of v. With
  // `angle_known` false the drag is averaged over equally spaced orientations.
  // Throws std::invalid_argument.
  DragModel(const FloatingBlock& block, const SplineView& flow, const double* coefficients,
            double drag_coefficient, bool angle_known);

  // Orientations between 0 and a quarter turn that stand for an unknown angle. With eight the drag
  // is within 1 % of that of many, mostly 0.1 % (cpp/tests/test_infer.cpp).
  static constexpr int orientations = 8;

  // Flow, block and orientations, with pointers into this object.
  FilterProblem problem() const;
  std::int64_t coefficients() const { return 2 * std::int64_t(flow_.rows) * flow_.columns; }
  // The most strips that can take part at once.
  std::int64_t shares() const;

  // The mean acceleration, and if not null its derivative by the coefficients [2][coefficients()].
  DragResponse drag(double theta, double omega, const double mean[4], const double (*covariance)[4],
                    double* by_coefficients) const;

private:
  SplineView flow_;
  StripBlock block_;
  bool angle_known_;
  std::vector<double> nodes_;
  std::array<double, orientations> cosine_, sine_;
};

struct FilterSettings {
  double noise_intensity; // [m^2/s^3]
  double position_noise;  // [m]
  double largest_step;    // [s]
  double longest_gap;     // [s]
};

class InnovationsFilter {
public:
  // Copies the track. Throws std::invalid_argument.
  InnovationsFilter(const Track& track, DragModel model, const FilterSettings& settings,
                    bool sensitivities);
  InnovationsFilter(const InnovationsFilter&) = delete;
  InnovationsFilter& operator=(const InnovationsFilter&) = delete;

  std::int64_t samples() const { return problem_.track.samples; }
  std::int64_t remaining() const { return samples() - state_.next; }
  std::int64_t parameters() const { return model_.coefficients() + 1; }
  bool sensitivities() const { return !shares_.empty(); }

  // The next min(count, remaining()) samples.
  void run(std::int64_t count, const FilterOutputs& out);

private:
  void copy(const Track& track);

  DragModel model_;
  std::vector<double> track_;
  std::vector<std::uint8_t> excluded_;
  std::vector<StripShare> shares_;
  std::vector<double> sensitivity_;
  FilterProblem problem_;
  FilterScratch scratch_;
  FilterState state_;
};

} // namespace driftwalk
