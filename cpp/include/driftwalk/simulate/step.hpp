// One time step of several packs of bodies, each alone: through the water, then off the wall.
//
// A step is a long chain of operations that wait for each other. So each part of it is done for all
// packs before the next: while one pack waits, the processor works on another.
#pragma once

#include "driftwalk/physics/drag.hpp"
#include "driftwalk/physics/integrator.hpp"
#include "driftwalk/physics/panels.hpp"
#include "driftwalk/physics/physics.hpp"
#include "driftwalk/physics/wall.hpp"
#include "driftwalk/physics/water.hpp"

DRIFTWALK_LANES_BEGIN

// A pack of blocks, one per lane, and the step that is under way.
template <class Real, class T, class Law>
struct BlockPack {
  Physics<Real, T, Law> physics;
  Body<Real> body;
  Motion<Real> noise; // acceleration by the stochastic force
  Pose<Real> before;  // at the start of the step
  Ahead<Real> ahead;
  Axes<Real> axes; // of ahead
  WaterPush<Real> push;
  Real turned; // by the water [rad]
};

template <class Real, class T, class Law>
inline void begin_step(BlockPack<Real, T, Law>& pack) {
  pack.before = pack.body.pose;
  pack.ahead = look_ahead(pack.physics.step, pack.body, pack.noise);
  pack.axes = axes_at(pack.ahead.pose.theta);
}

// The same of a body that is no single block.
template <class Real, class T, class Law>
inline void feel_water_by_panels(BlockPack<Real, T, Law>& pack) {
  const Physics<Real, T, Law>& physics = pack.physics;
  const BodyShape<T>& shape = physics.shape;
  const Pose<Real>& pose = pack.ahead.pose;
  const T half = T(0.5) * physics.step.dt;
  const DragSums<Real> sums =
      panel_sums(physics.law, shape, physics.flow, pose.x, pose.y, pack.axes, pack.ahead.motion);
  const Real per_mass = physics.world.drag_per_mass, per_inertia = physics.world.drag_per_inertia;
  WaterPush<Real>& push = pack.push;
  push.acceleration = {sums.force_x * per_mass, sums.force_y * per_mass, sums.torque * per_inertia};
  if (physics.water.count > 0) {
    push.acceleration =
        push.acceleration + water_acceleration(physics.water, shape, pack.axes, pose.x, pose.y);
  }
  push.stiffness = sums.conductance * per_mass * half;
  push.spin_stiffness = sums.conductance * per_inertia * (shape.turning_share * half);
}

template <class Real, class T, class Law>
inline void feel_water(BlockPack<Real, T, Law>& pack) {
  const Physics<Real, T, Law>& physics = pack.physics;
  if (physics.shape.panel_count > 0) {
    feel_water_by_panels(pack);
    return;
  }
  const Pose<Real>& pose = pack.ahead.pose;
  const T half = T(0.5) * physics.step.dt;
  const DragSums<Real> sums = drag_sums(physics.law, physics.block, physics.flow, pose.x, pose.y,
                                        pack.axes, pack.ahead.motion);
  const Real per_mass = physics.world.drag_per_mass, per_inertia = physics.world.drag_per_inertia;
  WaterPush<Real>& push = pack.push;
  push.acceleration = {sums.force_x * per_mass, sums.force_y * per_mass, sums.torque * per_inertia};
  if (physics.water.count > 0) {
    push.acceleration = push.acceleration +
                        water_acceleration(physics.water, physics.block, pose.x, pose.y, pack.axes);
  }
  push.stiffness = sums.conductance * per_mass * half;
  push.spin_stiffness = sums.conductance * per_inertia * (turning_share(physics.block) * half);
}

// Of a tank that is no circle, in one go.
template <class Real, class T, class Law>
inline void leave_walls(BlockPack<Real, T, Law>* packs, int count) {
  const WallView<T>& wall = packs[0].physics.wall;
  const T h = packs[0].physics.block.half_side;
  const Real per_inertia{packs[0].physics.step.per_inertia};
  const BodyShape<T>& shape = packs[0].physics.shape;
  const bool round = wall.radius > T(0) && shape.panel_count == 0;
  CircleContacts<Real> found[most_packs];
  for (int p = 0; p < count && round; ++p) {
    find_circle(wall, h, NoArm{}, axes_at<Real>, packs[p].body.pose, found[p]);
  }
  for (int p = 0; p < count; ++p) {
    Body<Real>& body = packs[p].body;
    if (round) {
      leave_circle(wall, per_inertia, found[p], body.pose, body.motion);
    } else if (shape.panel_count > 0) {
      found[p].touched = meet_wall(wall, shape, per_inertia, body.pose, body.motion);
    } else {
      found[p].touched = meet_wall(wall, h, per_inertia, body.pose, body.motion);
    }
    if (any(found[p].touched)) {
      forget_drag(found[p].touched, body);
    }
  }
}

template <class Real, class T, class Law>
inline void step_packs(BlockPack<Real, T, Law>* packs, int count) {
  for (int p = 0; p < count; ++p) {
    begin_step(packs[p]);
  }
  for (int p = 0; p < count; ++p) {
    feel_water(packs[p]);
  }
  for (int p = 0; p < count; ++p) {
    BlockPack<Real, T, Law>& pack = packs[p];
    pack.turned =
        finish_step(pack.physics.step, pack.noise, pack.ahead.motion, pack.push, pack.body);
  }
  leave_walls(packs, count);
}

DRIFTWALK_LANES_END
