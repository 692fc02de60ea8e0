// The innovations of a track under a flow, a drag coefficient and a noise: what the likelihood fit
// is made of.
#pragma once

#include "driftwalk/infer/problem.hpp"

#include <array>
#include <variant>
#include <vector>

namespace driftwalk {

struct FloatingBlock {
  double side;          // [m]
  double mass;          // [kg]
  double depth;         // of the wetted sides [m]
  int strips;           // a side
  double water_density; // [kg/m^3]
  // A body that is no single square block, as of BatchModel; of a disc, `round`. Then `side` is its
  // size, and it looks the same after a turn by 2 pi / symmetry.
  const double* panels = nullptr;
  int panel_count = 0;
  const double* moment_points = nullptr;
  int moment_point_count = 0;
  double mass_by_inertia = 0; // [1/m^2]
  int symmetry = 4;
  bool round = false;
};

// What is known of the block's orientation.
enum class Angle {
  given, // an input, with its rate
  none,  // nothing: the drag is averaged over equally spaced orientations, without turning
  state, // measured with noise, like the position, and predicted like it
};

// A block in a spline flow. Copies the coefficients.
class DragModel {
public:
  // `flow.nodes` is not read; coefficients are [layers][2][rows][columns], of u and of v.
  // Throws std::invalid_argument.
  // A disc has no angle: Angle::none.
  DragModel(const FloatingBlock& block, const SplineView& flow, const double* coefficients,
            double drag_coefficient, Angle angle, const ForceLaw& law = {});

  // Orientations between 0 and a quarter turn, or as much as the body's symmetry leaves, that
  // represent an unknown angle. With eight the drag is within 1 % of that of many, mostly 0.1 %
  // (cpp/tests/test_infer.cpp).
  static constexpr int orientations = 8;

  Angle angle() const { return angle_; }
  // Flow, block, law and orientations, with pointers into this object.
  FilterProblem problem() const;
  std::int64_t coefficients() const {
    return 2 * std::int64_t(flow_.rows) * flow_.columns * flow_.layers;
  }
  int layers() const { return flow_.layers; }
  // The most strips that can take part at once.
  std::int64_t shares() const;

  // The mean acceleration, and if not null its derivative by the coefficients [D][coefficients()].
  // With one layer only. `mean` and `covariance` are those of UncertainBlock<D>; D = 3 with
  // Angle::state, else 2.
  template <int D>
  DragResponse<D> drag(double theta, double omega, const double* mean,
                       const double (*covariance)[2 * D], double* by_coefficients) const;

private:
  void make_panels(const FloatingBlock& block);

  SplineView flow_;
  StripBlock block_;
  ForceLaw law_;
  Angle angle_;
  std::vector<double> nodes_, panels_, points_;
  int orientations_; // that are used, where the angle is not known
  std::array<double, orientations> cosine_, sine_;
};

struct FilterSettings {
  double noise_intensity;  // [m^2/s^3]
  double position_noise;   // [m]
  double force_lever;      // rms distance from the centre at which the force acts [m]
  double angle_noise;      // [rad]; read with Angle::state only, as the lever is
  double largest_step;     // [s]
  double longest_gap;      // [s]
  double time_noise = 0;   // of the time stamps [s]
  double force_memory = 0; // correlation time of the force [s]
};

class InnovationsFilter {
public:
  // Copies the track. Throws std::invalid_argument.
  InnovationsFilter(const Track& track, DragModel model, const FilterSettings& settings,
                    bool sensitivities);
  InnovationsFilter(const InnovationsFilter&) = delete;
  InnovationsFilter& operator=(const InnovationsFilter&) = delete;

  std::int64_t samples() const { return problem_.track.samples; }
  std::int64_t remaining() const;
  std::int64_t parameters() const { return model_.coefficients() + 1; }
  bool sensitivities() const { return sensitivities_; }
  // Coordinates of a sample: 3 with Angle::state, else 2.
  int coordinates() const { return model_.angle() == Angle::state ? 3 : 2; }
  // Coordinates, velocities, and a force that remembers.
  int state_size() const { return 2 * coordinates() + (problem_.force_memory > 0 ? 2 : 0); }

  // The next min(count, remaining()) samples.
  void run(std::int64_t count, const FilterOutputs& out);

  // All samples that remain: adds up J' J [parameters][parameters] and R' J [columns][parameters],
  // J the whitened derivatives of samples that are used and kept, [samples][coordinates] rows, R
  // the numbers beside them; null: all that are used, and the whitened innovations. Up to `pooled`
  // samples in a row count in J' J as their mean. Needs sensitivities. Writes what a pass finds.
  struct Sums {
    std::vector<double> information, products;
  };
  Sums sums(const std::uint8_t* kept, const double* right, int columns, std::int64_t pooled,
            const FilterOutputs& out);

private:
  template <int D, int F>
  struct Memory {
    FilterState<D, F> state;
    FilterScratch<D> scratch;
    std::vector<StripShare<D>> shares;
    std::vector<PointShare<D>> points;
    std::vector<double> sensitivity, row;
    std::vector<double> sum, sum_rate, weight, weight_rate;
    std::vector<std::uint8_t> touched;
    std::vector<std::int32_t> active;
  };

  void copy(const Track& track);
  template <int D, int F>
  void make_memory();
  template <int D>
  void make_memory_for(double force_memory);
  void run(std::int64_t count, const FilterOutputs& out, const ProductSums* sums);

  DragModel model_;
  bool sensitivities_;
  std::vector<double> track_;
  std::vector<std::uint8_t> excluded_;
  FilterProblem problem_;
  std::variant<Memory<2, 0>, Memory<3, 0>, Memory<2, 2>, Memory<3, 2>> memory_;
};

} // namespace driftwalk
