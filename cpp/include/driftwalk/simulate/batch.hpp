// What a batch of one-block worlds is: plain data that Python's side fills in, no logic.
#pragma once

#include <cstdint>

namespace driftwalk {

// Bits of a world's status. In a batch a failure is data: the other worlds go on.
enum Status : std::uint32_t {
  status_ok = 0,
  status_non_finite = 1u << 0, // a pose stopped being a number
  status_escaped = 1u << 1,    // the centre left the arena's bounding box
  status_no_motion = 1u << 2,  // mean speed below 1 um/s in the second half of the run
};

// The same for every world of a batch. Lengths in m, times in s, SI throughout.
struct BatchModel {
  // block
  double side = 0, mass = 0, inertia = 0, depth = 0;
  int strips = 8;
  // water
  double water_density = 0;
  // wall: a circle about the origin, or the edges of a convex polygon (nx, ny, distance) x count
  double radius = 0;
  const double* edges = nullptr;
  int edge_count = 0;
  double restitution = 0, friction = 0, bounce_speed = 0;
  // flow on nodes [frames][rows][columns]; frame_time is increasing, one frame means steady
  const double* flow_u = nullptr;
  const double* flow_v = nullptr;
  int frames = 1, rows = 0, columns = 0;
  const double* frame_time = nullptr;
  double origin_x = 0, origin_y = 0, spacing_x = 0, spacing_y = 0;
  // time
  double time_step = 0;
  int steps_per_interval = 1; // force interval / time step
  // sampling: times from the start [s], increasing, from 0
  const double* sample_time = nullptr;
  std::int64_t samples = 0;
  // camera
  double position_noise = 0, orientation_noise = 0, position_quantum = 0;
  // What the camera sees: a circle, or the edges of a convex polygon (nx, ny, distance) x count;
  // neither means everything. Samples outside are missing (NaN).
  double view_radius = 0, view_x = 0, view_y = 0;
  const double* view_edges = nullptr;
  int view_edge_count = 0;
};

// One entry per world.
struct BatchWorlds {
  std::int64_t count = 0;
  const double* drag_coefficient = nullptr;
  const double* force_std = nullptr;  // [N]
  const std::uint64_t* key = nullptr; // hash of (seed, trial, replicate)
  const double* x = nullptr;
  const double* y = nullptr;
  const double* theta = nullptr;
  const double* vx = nullptr;
  const double* vy = nullptr;
  const double* omega = nullptr;
};

} // namespace driftwalk
