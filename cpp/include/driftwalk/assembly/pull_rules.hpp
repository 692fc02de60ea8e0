// How blocks pull at each other from a distance: tables, plain data.
#pragma once

#include <cstdint>

namespace driftwalk {

// A function of the squared distance, linear within cells of 1/64 of an octave: its value at the
// lower end of a cell and its slope, one pair after the other. Below the first cell it is constant;
// the last pair holds for all that lies beyond, and is (0, 0) for faces. Look-ups in single
// precision read two numbers more than there are, and use none of the two.
struct RadialTable {
  const float* single = nullptr;
  const double* twice = nullptr; // the same numbers
  int cells = 0;                 // 0: there is no such function
  int first = 0;                 // number of the first cell: a float's bits without the lowest 17
};

// Energy [J] of two faces with an axis each, by the coefficients of a quadratic B-spline: in the
// logarithm of the distance; in the direction of the second from the first, against the first's
// normal; in the angle of the second's inward normal against it. Both angles go round.
struct OrientedTable {
  const float* coefficient = nullptr; // [distance][direction][angle]
  int distances = 0, angles = 0;
  double first = 0, per_step = 0; // logarithm of the first distance; steps per unit of it
  double low = 0, high = 0;       // distances between which it holds [m]
};

// Energy [J] of two faces with an axis each, as of dipoles and the next multipoles. With
// h = 1 / sqrt(distance² + softening), p and q the way times h along the normals, w the cosine
// between these, u = p q and v = p² + q² it is
// h³ (w (c0 + c1 h² + c2 h² v) + u (c3 + c4 h² + c5 h² v)), led to 0 between two distances.
struct Multipoles {
  bool on = false;
  double softening = 0;       // [m^2]
  double coefficient[6] = {}; // c0 and c3 in J m^3, the others in J m^5
  double fading = 0, end = 0; // squares of these distances [m^2]
};

struct PullRules {
  bool on = false;
  double reach = 0;              // blocks whose centres are farther apart feel nothing [m]
  RadialTable centres;           // attraction between the centres, per distance [N/m]
  RadialTable resistance;        // to closing or parting speed, per squared distance [N s/m^3]
  RadialTable faces;             // attraction between points of two faces, per distance [N/m]
  OrientedTable oriented;        // between the same points
  Multipoles multipoles;         // and to this the table adds what is missing near by
  double lever = 0;              // of these points, from the centre of the block [m]
  double pole[4] = {1, 1, 1, 1}; // of the faces, in the block's own frame
  bool like_poles_repel = false;
  // Between two distances a force of faces goes over from one that acts in each step to one that
  // acts in every `every`-th only, as many times as strong (impulses of r-RESPA).
  int every = 1;
  double near_fading = 0, near_end = 1; // squares of these distances [m^2]
  double near_reach = 0;                // as `reach`, in the steps between

  // Whether distant faces act in a time step: in the middle of so many.
  bool is_whole(std::int64_t step) const { return step % every == every / 2; }
};

} // namespace driftwalk
