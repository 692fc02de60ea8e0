// What a batch of worlds with one body each is: plain data that Python's side fills in, no logic.
#pragma once

#include "driftwalk/particle/columns.hpp"
#include "driftwalk/simulate/model_numbers.hpp"

#include <cstdint>

namespace driftwalk {

// Bits of a world's status. In a batch a failure is data: the other worlds go on.
enum Status : std::uint32_t {
  status_ok = 0,
  status_non_finite = 1u << 0, // a pose stopped being a number
  status_escaped = 1u << 1,    // the centre left the arena's bounding box
  status_no_motion = 1u << 2,  // mean speed below 1 um/s in the second half of the run
};

// How a flow in frames goes on before its first frame and after its last: it stands, it begins
// again with the first frame (where the last one has to lead), or it runs backwards and forwards in
// turns.
enum class FlowRepeat : int { hold, loop, mirror };

// The same for every world of a batch. Lengths in m, times in s, SI throughout.
struct BatchModel : ModelNumbers {
  // wall: a circle about the origin, or the edges of a convex polygon (nx, ny, distance) x count
  const double* edges = nullptr;
  int edge_count = 0;
  // A body that is no single square block: panels (x, y, nx, ny, width) x count, of which the last
  // counts its share where the water does not quite reach; corners (x, y) x count, none of a disc;
  // points (x, y, share) x count for means over its area. All from its centre of mass. None of
  // them: the square block.
  const double* panels = nullptr;
  int panel_count = 0;
  const double* corners = nullptr;
  int corner_count = 0;
  const double* moment_points = nullptr;
  int moment_point_count = 0;
  // flow on nodes [frames][rows][columns]; frame_time is increasing, one frame means steady
  const double* flow_u = nullptr;
  const double* flow_v = nullptr;
  int frames = 1, rows = 0, columns = 0;
  const double* frame_time = nullptr;
  FlowRepeat repeat = FlowRepeat::hold;
  // sampling: times from the start [s], increasing, from 0
  const double* sample_time = nullptr;
  std::int64_t samples = 0;
  // What the camera sees: a circle, or the edges of a convex polygon (nx, ny, distance) x count;
  // neither means everything.
  const double* view_edges = nullptr;
  int view_edge_count = 0;
};

// One entry per world.
struct BatchWorlds {
  std::int64_t count = 0;
  ParticleModel particle; // of no kind: the body is a block, with the next two numbers
  const double* drag_coefficient = nullptr;
  const double* force_std = nullptr;  // [N]
  const std::uint64_t* key = nullptr; // hash of (seed, trial, replicate)
  // Time on the clock of the flow's frames at which a world begins [s]; null: 0 for all.
  const double* flow_start = nullptr;
  const double* x = nullptr;
  const double* y = nullptr;
  const double* theta = nullptr;
  const double* vx = nullptr;
  const double* vy = nullptr;
  const double* omega = nullptr;
};

} // namespace driftwalk
