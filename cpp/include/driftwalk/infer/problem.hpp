// What the innovations filter reads and writes. Plain numbers and pointers: the kernel is compiled
// once per instruction set and must share no container code (see config.hpp).
#pragma once

#include <cstdint>

namespace driftwalk {

// The flow of the water: uniform bicubic B-splines,
//     u(x, y) = sum over j, i of c[j][i] B((x - origin_x)/spacing - i) B((y - origin_y)/spacing -
//     j)
// times its strength. With several layers it is their sum, each times its own strength.
// B is the cubic B-spline of support [-3, 1]: on the cell [k, k + 1] the nodes k .. k + 3 count, so
// the grid covers columns - 3 by rows - 3 cells. Beyond it the value at its edge goes on.
struct SplineView {
  const double* nodes;       // [layers][rows][columns][2]: coefficients of u and v [m/s]
  double origin_x, origin_y; // [m]
  double spacing;            // [m]
  int columns, rows;         // at least 4 each
  int layers = 1;
};

// Panels of a body that is no single square block (physics/panels.hpp), eight a row: [rows][6][8],
// their places x, y [m], outward normals nx, ny, weights and whether there is one.
struct PanelRows {
  const double* rows;
  int count = 0; // 0: the sides of the square block
};

// The sides of the block, cut into strips.
struct StripBlock {
  double half_side;   // [m]
  double strip_width; // [m]
  int strips;         // a side
  double drag_scale; // acceleration by a strip's squared closing speed, 1/2 rho C_d (a/N) d/m [1/m]
  double mass_by_inertia; // m/I [1/m^2]
  // Points at which the water's acceleration pushes it, in its frame, and what each counts.
  const double* point; // [points][3]: x, y, share of the area [m, m, 1]
  int points;
  double reach; // how far from its centre the flow matters [m]
  PanelRows panels{};
};

// The drag's force goes with the power p of the speed |w| past a strip: it is that of the law times
// (|w| / reference)^(p - 2). As it stands, the law's own.
struct DragPower {
  double power = 2;
  double reference = 0.03; // [m/s]
  // What a variance of the velocity counts near rest (expected_drag.hpp); the model computes it.
  double at_rest = 1;
};

// How the block answers the water.
struct ForceLaw {
  double quadratic = 1; // share of the drag on windward strips that goes with the closing speed
  double linear = 0;    // the drag of every strip is this times its slip, over that scale [m/s]
  // The water's own acceleration Du/Dt, and half its curl, push the block so strongly; 1 for a body
  // that displaces its own mass.
  double water_acceleration = 0;
  double water_spin = 0;
  DragPower power;
};

// The orientations over which the drag is averaged: those of a block whose angle is not known.
struct Orientations {
  const double* cosine;
  const double* sine;
  int count; // 0: the angle of the track
};

// What is known of the block's angle is either an input, in `theta` and `omega` without holes, or a
// measurement like the position, in `theta` alone, NaN where it is missing.
struct Track {
  const double* time;  // [s], increasing
  const double* x;     // [m], NaN where a sample is missing
  const double* y;     // [m]
  const double* theta; // [rad]; an input has no jumps by 2 pi
  const double* omega; // [rad/s]
  // Of each layer, [layers][samples], linear between samples; null with one layer: 1 all the time.
  const double* strength;
  const std::uint8_t* excluded; // 1: the interval that ends here says nothing about the water
  std::int64_t samples;
  // Mean and standard deviation of vx, vy, omega if the state begins at the sample, as it does
  // where one is excluded and they are known, [samples][6] [m/s, rad/s]; null, or NaN: 0 and that
  // of an unknown speed.
  const double* velocity_prior = nullptr;
};

struct FilterProblem {
  SplineView flow;
  StripBlock block;
  ForceLaw law;
  Orientations orientations;
  Track track;
  double intensity[3];  // the variances of vx, vy, omega grow by it times dt [m^2/s^3, rad^2/s^3]
  double force_memory;  // correlation time of the force on x and y [s]; 0: none
  double variance[3];   // of a sample's x, y, theta [m^2, rad^2]
  double time_variance; // of its time stamp [s^2]
  double largest_step;  // [s]
  double longest_gap;   // [s] since the last sample; beyond it the state restarts
};

// What the filter knows: D coordinates, x, y and for D = 3 theta, their D velocities, and with F =
// 2 the acceleration by a force that remembers.
template <int D, int F>
struct FilterState {
  static constexpr int size = 2 * D + F;
  double mean[size];
  double covariance[size][size];
  double seen;       // time of the last sample that was there [s]
  bool open;         // whether there is a state at all
  int outliers;      // samples in a row that were no noise
  std::int64_t next; // the sample that comes next
  // After a gap or a contact with the wall, and no sample has given a velocity since.
  bool restarted;
  double undragged; // the velocity is that of so long ago; the drag since is still to act [s]
};

// The part of one strip in d(acceleration)/d(coefficients).
template <int D>
struct StripShare {
  double response[D][2]; // d(acceleration)/d(velocity of the strip), [axis][x, y]
  double weight_y[4];    // B in y at the four rows of nodes
  double along_x;        // place in the cell, [0, 1]
  std::int32_t node;     // row * columns + column of the first of the 4 x 4 nodes
};

// A point at which the water's acceleration is taken, and its part in
// d(acceleration)/d(coefficients). With w the spline's value there and g = u . grad of it, a
// coefficient of the velocity along c adds by_value[a][c] w + by_slope[a][c] g.
template <int D>
struct PointShare {
  double by_value[D][2], by_slope[D][2];
  double by_rate[D][2];            // of the derivative of the flow by time, with several layers
  double u, v;                     // the flow there, without its strength [m/s]
  double weight_x[4], weight_y[4]; // B at the four columns and rows of nodes
  double slope_x[4], slope_y[4];   // its derivatives [1/m]
  std::int32_t node;               // as of a StripShare
};

// Memory of a filter, made once.
template <int D>
struct FilterScratch {
  // With several layers: their sum near the block, and its derivative by time, as the nodes of one;
  // the strength of each layer and its derivative.
  double *sum, *sum_rate;       // [rows][columns][2]
  double *weight, *weight_rate; // [layers]
  StripShare<D>* shares; // one for each strip of each orientation; null without sensitivities
  PointShare<D>* points; // one for each point of the area; null without sensitivities
  double* sensitivity;   // [2 D + F][stride]: d(state)/d(parameters)
  double* row;           // [D][stride]
  std::uint8_t* touched; // [stride / 8]: whether eight columns are not zero
  std::int32_t* active;  // [stride / 8]: the groups of eight columns that are not
  std::int64_t stride;   // a multiple of 8, at least parameters
  std::int64_t
      parameters; // 2 rows columns layers + 1: coefficients of u, of v of each layer, then ln C_d
  int layers;
};

// Results of `count` samples. An innovation that does not exist is NaN.
struct FilterOutputs {
  double* innovation; // [count][D]: sample minus prediction [m, m, rad]
  double* covariance; // [count][D (D + 1)/2]: of the innovation: xx, xy, yy, x theta, ...
  std::uint8_t* used; // [count]: whether the innovation belongs to the likelihood
  double* state;      // [count][2 D]: after the sample; null: not wanted
  double* whitened;   // [count][D]: L^-1 innovation, L L' its covariance; 0 where not used
  double* jacobian;   // [D count][parameters]: L^-1 d(prediction)/d(parameters); 0 where not used
  // With more than one, the rows of so many samples are added up: [D ceil(count / pooled)], zero
  // before.
  std::int64_t pooled = 1;
  // [count][3][2 D + F][2 D + F]: how the error of the state goes on from the sample before, 0
  // where the state begins; its covariance before the sample; and after it. Null: not wanted.
  double* errors = nullptr;
};

// What the filter adds up instead of handing out its derivatives, and the room for it. `stride` is
// that of the scratch.
struct ProductSums {
  static constexpr int most_rows = 48;
  int columns;              // R, beside the derivatives
  std::int64_t pooled;      // most samples in a row whose derivatives count as their mean in J' J
  std::int64_t first;       // the sample with which kept and right begin
  const std::uint8_t* kept; // [samples]: 0 leaves a sample out of the sums; null: none
  const double* right;      // [samples][D][columns]; null: the whitened innovations, one column
  double* information;      // [stride][stride]: J' J, on and above the diagonal
  double* products;         // [columns][stride]: R' J
  double* rows;             // [stride / 8][most_rows][8], zero before
  std::uint8_t* written;    // [stride / 8], zero before: whether eight columns are not zero
  double* means;            // as rows; of several samples each, read where pooled is above 1
  std::uint8_t* written_means;
  double* size;         // [stride]: of the largest derivative in a column
  double* dense;        // [stride / 8][most_rows][8]: the columns that count
  std::int32_t* chosen; // [stride]: which they are
  double* beside;       // [most_rows][columns]
};

// The mean acceleration of a block whose state is uncertain: of x, y and for D = 3 of the angle.
template <int D>
struct DragResponse {
  double acceleration[D];   // [m/s^2, rad/s^2]
  double drag[D];           // the part of it that the drag has
  double by_position[D][D]; // [axis of the acceleration][coordinate]
  double by_velocity[D][D];
  double bend[D][D][D]; // second derivatives by velocities
  int shares;           // strips that take part
  int points;           // of the water's acceleration
};

} // namespace driftwalk
