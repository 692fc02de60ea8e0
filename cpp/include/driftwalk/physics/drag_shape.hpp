#pragma once

namespace driftwalk {

// How the drag of a world goes with the speed, beside the drag coefficient.
template <class T>
struct DragShape {
  T linear;           // of every strip in addition, per K and slip [m/s]; 0: nothing
  T exponent;         // of |w|^2 over that of the reference speed, p/2 - 1; 0: the law's own
  T per_square_speed; // 1 / reference speed^2 [s^2/m^2]
  bool is_quadratic;  // whether it is the quadratic law and nothing else
};

} // namespace driftwalk
