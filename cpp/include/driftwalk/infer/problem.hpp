// What the innovations filter reads and writes. Plain numbers and pointers: the kernel is compiled
// once per instruction set and must share no container code (see config.hpp).
#pragma once

#include <cstdint>

namespace driftwalk {

// The flow of the water: uniform bicubic B-splines,
//     u(x, y) = sum over j, i of c[j][i] B((x - origin_x)/spacing - i) B((y - origin_y)/spacing -
//     j)
// with B the cubic B-spline of support [-3, 1]: on the cell [k, k + 1] the nodes k .. k + 3 count,
// so the grid covers columns - 3 by rows - 3 cells. Beyond it the value at its edge goes on.
struct SplineView {
  const double* nodes;       // [rows][columns][2]: coefficients of u and v [m/s]
  double origin_x, origin_y; // [m]
  double spacing;            // [m]
  int columns, rows;         // at least 4 each
};

// The sides of the block, cut into strips.
struct StripBlock {
  double half_side;   // [m]
  double strip_width; // [m]
  int strips;         // a side
  double drag_scale; // acceleration by a strip's squared closing speed, 1/2 rho C_d (a/N) d/m [1/m]
};

// The orientations over which the drag is averaged: those of a block whose angle is not known.
struct Orientations {
  const double* cosine;
  const double* sine;
  int count; // 0: the angle of the track
};

struct Track {
  const double* time;           // [s], increasing
  const double* x;              // [m], NaN where a sample is missing
  const double* y;              // [m]
  const double* theta;          // [rad], continuous: no jumps by 2 pi
  const double* omega;          // [rad/s]
  const std::uint8_t* excluded; // 1: the interval that ends here says nothing about the water
  std::int64_t samples;
};

struct FilterProblem {
  SplineView flow;
  StripBlock block;
  Orientations orientations;
  Track track;
  double noise_intensity;   // q: the velocity's variance grows by q dt [m^2/s^3]
  double position_variance; // of one coordinate of a sample [m^2]
  double largest_step;      // [s]
  double longest_gap;       // [s] since the last sample; beyond it the state starts anew
};

// Position and velocity: what the filter knows of them.
struct FilterState {
  double mean[4];          // x, y, vx, vy
  double covariance[4][4]; // of the same
  double seen;             // time of the last sample that was there [s]
  bool open;               // whether there is a state at all
  std::int64_t next;       // the sample that comes next
};

// The part of one strip in d(acceleration)/d(coefficients).
struct StripShare {
  double response[4]; // d(acceleration)/d(block velocity) of the strip, [axis][axis] [1/s]
  double weight_y[4]; // B in y at the four rows of nodes
  double along_x;     // place in the cell, [0, 1]
  std::int32_t node;  // row * columns + column of the first of the 4 x 4 nodes
};

// Memory of a filter, made once.
struct FilterScratch {
  StripShare* shares;      // one for each strip of each orientation; null without sensitivities
  double* sensitivity;     // [4][stride]: d(state)/d(parameters)
  std::int64_t stride;     // a multiple of 8, at least parameters + 8
  std::int64_t parameters; // 2 rows columns + 1: coefficients of u, of v, then ln C_d
};

// Results of `count` samples. An innovation that does not exist is NaN.
struct FilterOutputs {
  double* innovation; // [count][2]: sample minus prediction [m]
  double* covariance; // [count][3]: of the innovation, xx, xy, yy [m^2]
  std::uint8_t* used; // [count]: whether the innovation belongs to the likelihood
  double* state;      // [count][4]: after the sample [m, m, m/s, m/s]
  double* whitened;   // [count][2]: L^-1 innovation, L L' its covariance; 0 where not used
  double* jacobian;   // [2 count][parameters]: L^-1 d(prediction)/d(parameters); 0 where not used
};

// The mean acceleration of a block whose position and velocity are uncertain.
struct DragResponse {
  double acceleration[2];   // [m/s^2]
  double by_position[2][2]; // [axis of the acceleration][axis of the position] [1/s^2]
  double by_velocity[2][2]; // [1/s]
  int shares;               // strips that take part
};

} // namespace driftwalk
