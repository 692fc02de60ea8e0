// A batch made ready for the kernels: constants and tables in the kernels' number type.
#pragma once

#include "driftwalk/physics/drag_shape.hpp"
#include "driftwalk/simulate/batch.hpp"

#include <cstdint>

namespace driftwalk {

// An edge of a polygonal arena.
template <class T>
struct PreparedEdge {
  T normal_x, normal_y; // outward unit normal
  T distance;           // of the edge from the origin along the normal [m]
};

template <class T>
struct BlockShape {
  T half_side;   // h = a/2 [m]
  T strip_width; // a/N [m]
  int strips;    // N
};

// A flat piece of a body's side, in the frame of the body about its centre of mass.
template <class T>
struct Panel {
  T x, y;   // of its middle [m]
  T nx, ny; // outward normal
  T weight; // its width, in those of the mean panel; less where the water reaches only a share
};

template <class T>
struct Corner {
  T x, y; // from the centre of mass [m]
};

// A point of a body's area, and the share of the area that it counts.
template <class T>
struct AreaPoint {
  T x, y, share;
};

// A rigid body that is no single square block. Plain pointers, as in Prepared.
template <class T>
struct BodyShape {
  const Panel<T>* panels;
  int panel_count;          // 0: the square block
  const Corner<T>* corners; // that may touch a wall
  int corner_count;
  T disc_radius;              // [m]; 0: a body with corners
  T half_length, half_width;  // of a rectangle, along its own x and y [m]; 0: another body
  T reach;                    // of its farthest point from the centre of mass [m]
  T turning_share;            // conductance for turning over that for moving [m^2]
  const AreaPoint<T>* points; // for means of the water's acceleration over its area
  int point_count;
  T per_radius_square; // m/I of an even body: 1 / mean squared distance of the points [1/m^2]
};

template <class T>
struct StepConstants {
  T dt;          // [s]
  T per_dt;      // 1/dt
  T per_inertia; // m/I [1/m^2]
};

template <class T>
struct WallView {
  T radius;                     // of a circle [m]; 0 for a polygon
  const PreparedEdge<T>* edges; // of a polygon
  int edge_count;
  T restitution;
  T friction;
  T bounce_speed; // no bounce below it [m/s]
};

// Numbers in one node's record of the flow table: (u, u above, v, v above).
inline constexpr int flow_record = 4;

// The flow table's numbers: 16-bit integers for the float kernels, doubles for the reference.
template <class T>
struct FlowNumber {
  using type = T;
};
template <>
struct FlowNumber<float> {
  using type = std::int16_t;
};

// Lanes of a pack, at most.
inline constexpr int most_lanes = 16;

// Two tables for each lane of a pack, and what the second one counts: the frames around its time.
template <class T>
struct LaneTables {
  const typename FlowNumber<T>::type* before[most_lanes];
  const typename FlowNumber<T>::type* after[most_lanes];
  T weight[most_lanes]; // of `after`, 0 to 1
};

template <class T>
struct FlowView {
  const typename FlowNumber<T>::type* table; // [rows][1 << stride_bits][flow_record]
  const LaneTables<T>* lanes;                // in place of `table` in a flow in frames, else null
  int stride_bits;
  T unit;     // velocity of a looked-up number of 1 [m/s]
  T origin_x; // position of node (0, 0) [m]
  T origin_y;
  T per_spacing_x; // 1 / node spacing [1/m]
  T per_spacing_y;
  T low_x, high_x; // where a block's centre may be for every strip to be on the table [m]
  T low_y, high_y;
};

// Up to so many tables make the water's acceleration at a time.
inline constexpr int most_water_tables = 4;

// Of a flow in frames, the tables of the water's acceleration that each lane needs, and their
// parts.
template <class T>
struct LaneWater {
  LaneTables<T> table[most_water_tables];
  double part[most_water_tables][most_lanes];
};

// The water's acceleration Du/Dt on the nodes of the flow, and how it pushes a block: the sum of
// `count` tables, each times its part. A steady flow has one; cpp/src/prepare_water.cpp says which
// a flow in frames has.
template <class T>
struct WaterView {
  int count;                 // 0: the water's acceleration does not push
  FlowView<T> nodes;         // of the first table; its unit is in m/s^2
  const LaneWater<T>* lanes; // of a flow in frames, else null
  T part;                    // of the one table of a steady flow
  T strength;                // of the flow, a factor on its velocity
  T push;                    // (m_w + m_a)/(m + m_a), m_w the displaced mass
  T spin;                    // the same of the moments of inertia
};

// Everything a kernel reads, in its own number type. Plain pointers: the kernels are compiled once
// per instruction set and must share no container code (see config.hpp).
template <class T>
struct Prepared {
  BlockShape<T> block;
  BodyShape<T> shape;
  StepConstants<T> step;
  int steps_per_interval;
  double drag_scale; // 1/2 rho (a/N) d [kg/m^2]: K = drag_scale * C_d
  DragShape<T> drag;
  double mass, inertia; // with what is added to them
  WallView<T> wall;
  // flow: the first of `frames` tables, frame_size numbers each
  FlowView<T> flow;
  std::int64_t frame_size;
  int frames;
  const double* frame_time;
  FlowRepeat repeat;
  WaterView<T> water;
  // force: what is kept of the last one, 0 where it has no memory, and the spread of the first
  T force_kept, force_first;
  T force_lever; // torque of the stochastic force over the force along an axis [m]
  // sampling: sample k lies in step sample_step[k], at the fraction sample_weight[k] of it
  std::int64_t samples;
  const std::int64_t* sample_step;
  const T* sample_weight;
  // camera
  T position_noise, orientation_noise, position_quantum;
  // field of view: a circle of positive radius, or edges, or neither
  T view_radius, view_x, view_y;
  const PreparedEdge<T>* view_edges;
  int view_edge_count;
};

// Where the samples of a run go: sample k of lane l stands at [l * lane_stride + k].
template <class T>
struct SampleSink {
  T* x;
  T* y;
  T* theta;
  std::int64_t lane_stride;
};

// Packs of worlds that one call of a kernel takes together.
inline constexpr int most_packs = 4;

// Runs worlds first .. first + count - 1 (count <= most_packs * lanes) and writes their samples and
// status.
using SimulateLanes = void (*)(const Prepared<float>&, const BatchWorlds&, std::int64_t first,
                               int count, const SampleSink<float>&, std::uint32_t* status);

void simulate_reference(const Prepared<double>&, const BatchWorlds&, std::int64_t world,
                        const SampleSink<double>&, std::uint32_t* status);

} // namespace driftwalk
