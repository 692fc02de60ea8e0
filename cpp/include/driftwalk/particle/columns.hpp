// The numbers of a self-propelled particle's model: a table with one row of columns per world.
//
// The columns that all states share come first, then a block of columns for each state. What a
// column means is said once more, with ranges and units, in src/driftwalk/motion/family.
#pragma once

#include <cstdint>

namespace driftwalk {

// How a particle moves: it swims along its heading, or its velocity forgets.
enum class ParticleKind : std::int32_t { none = 0, switching = 1, inertial = 2 };

// At the wall: it slides along, or it is thrown back.
enum class WallContact : std::int32_t { slide = 0, reflect = 1 };

inline constexpr int most_particle_states = 4;

enum SharedColumn : int {
  column_clearance,        // distance of the centre from the wall at contact [m]
  column_diffusion,        // of the position [m^2/s]
  column_slow_std,         // of the logarithm of a slow factor on the speed [1]
  column_slow_time,        // how long that factor is remembered [s]
  column_stroke,           // the speed swings by this share of itself [1]
  column_stroke_frequency, // [Hz]
  column_wall_turn,        // rate of turning away from the wall, at contact [rad/s]
  column_wall_follow,      // rate of turning along the wall, at contact [rad/s]
  column_wall_slowing,     // share of the speed that is lost at contact [1]
  column_wall_range,       // over which these three decay [m]
  column_wall_gap,         // where turning away becomes turning towards; 0: nowhere [m]
  column_neighbour_push,  // part of the speed at which another body pushes it off, at its place [1]
  column_neighbour_range, // over which that decays [m]
  shared_columns
};

enum StateColumn : int {
  column_dwell_scale,          // of the Weibull law of how long a bout lasts [s]
  column_dwell_power,          // 1 / its shape [1]
  column_start_share,          // of worlds that begin in this state [1]
  column_speed,                // mean over bouts [m/s]
  column_speed_cv,             // spread over bouts, over the mean [1]
  column_relaxation_time,      // of the speed [s]
  column_coasting,             // above 0: a bout begins at its speed and glides to rest
  column_rotational_diffusion, // [rad^2/s]
  column_turn_rate,            // mean over bouts [rad/s]
  column_turn_rate_std,        // spread over bouts [rad/s]
  column_turn_std,             // of the turn at the beginning of a bout [rad]
  column_reversal_share,       // of bouts that begin with a turn by half a circle [1]
  state_columns
};

// A state's block ends with the chances of the states that follow it.
constexpr int particle_columns(int states) {
  return shared_columns + states * (state_columns + states);
}

// Columns of a particle whose velocity forgets.
enum InertialColumn : int {
  inertial_clearance, // distance of the centre from the wall at contact [m]
  inertial_speed_std, // of each component of the velocity [m/s]
  inertial_time,      // how long the velocity is remembered [s]
  inertial_turn_rate, // of the velocity [rad/s]
  inertial_columns
};

// Where other bodies are at the beginning of each time step, the same for every world; NaN where
// one is not there. After the last of the steps they stand still.
struct NeighbourTracks {
  std::int64_t steps = 0;
  int count = 0;
  const double* place = nullptr; // [step][neighbour][x, y] [m]
};

// The same for every world of a batch.
struct ParticleModel {
  ParticleKind kind = ParticleKind::none;
  WallContact contact = WallContact::slide;
  int states = 0;
  bool carried = false; // the water carries it
  NeighbourTracks neighbours;
  const double* values = nullptr; // [column][world]
};

} // namespace driftwalk
