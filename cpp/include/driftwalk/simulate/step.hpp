// One time step of a block alone: through the water, then off the wall.
#pragma once

#include "driftwalk/physics/drag.hpp"
#include "driftwalk/physics/integrator.hpp"
#include "driftwalk/physics/physics.hpp"
#include "driftwalk/physics/wall.hpp"
#include "driftwalk/physics/water.hpp"

DRIFTWALK_LANES_BEGIN

// Returns the angle by which the water has turned the block [rad].
template <class Real, class T, class Law>
inline Real step_block(const Physics<Real, T, Law>& physics, const Motion<Real>& noise,
                       Body<Real>& body) {
  const T half = T(0.5) * physics.step.dt;
  const Ahead<Real> ahead = look_ahead(physics.step, body, noise);
  const DragSums<Real> sums = drag_sums(physics.law, physics.block, physics.flow, ahead.pose.x,
                                        ahead.pose.y, axes_at(ahead.pose.theta), ahead.motion);
  const Real per_mass = physics.world.drag_per_mass, per_inertia = physics.world.drag_per_inertia;
  WaterPush<Real> push;
  push.acceleration = {sums.force_x * per_mass, sums.force_y * per_mass, sums.torque * per_inertia};
  if (physics.water.count > 0) {
    push.acceleration = push.acceleration + water_acceleration(physics.water, physics.block,
                                                               ahead.pose.x, ahead.pose.y);
  }
  push.stiffness = sums.conductance * per_mass * half;
  push.spin_stiffness = sums.conductance * per_inertia * (turning_share(physics.block) * half);
  const Real turned = finish_step(physics.step, noise, ahead.motion, push, body);
  const auto touched = meet_wall(physics.wall, physics.block.half_side,
                                 Real(physics.step.per_inertia), body.pose, body.motion);
  if (any(touched)) {
    forget_drag(touched, body);
  }
  return turned;
}

DRIFTWALK_LANES_END
