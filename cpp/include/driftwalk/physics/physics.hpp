// Everything that a time step of a pack of worlds reads.
#pragma once

#include "driftwalk/physics/drag_law.hpp"
#include "driftwalk/simulate/prepared.hpp"

DRIFTWALK_LANES_BEGIN

// What a world keeps through a run, one number per lane.
template <class Real>
struct WorldConstants {
  Real drag_per_mass;    // K/m [1/m]
  Real drag_per_inertia; // K/I [1/m^3]
  Real noise_scale;      // stochastic force per normal number and mass of a block [m/s^2]
};

template <class Real, class T, class Law>
inline WorldConstants<Real> world_constants(const Law& law, const Prepared<T>& run,
                                            Real drag_coefficient, Real force_std) {
  const Real strength = law.strength(drag_coefficient);
  return {strength * static_cast<T>(run.drag_scale / run.mass),
          strength * static_cast<T>(run.drag_scale / run.inertia),
          force_std * static_cast<T>(1.0 / run.mass)};
}

template <class Real, class T, DragLaw<Real> Law>
struct Physics {
  [[no_unique_address]] Law law;
  BlockShape<T> block;
  BodyShape<T> shape;
  FlowView<T> flow;
  WaterView<T> water;
  WallView<T> wall;
  StepConstants<T> step;
  WorldConstants<Real> world;
  T hidden_share = T(0); // of the drag of a free face that a joined face feels
  bool pulled = false;   // whether forces between blocks make the sums accelerations
};

DRIFTWALK_LANES_END
