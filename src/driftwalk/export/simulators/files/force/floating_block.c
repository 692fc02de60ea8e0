#include "floating_block.h"

#include <math.h>
#include <stddef.h>

static const double quarter_turn = 1.57079632679489661923;

/* ---- what moves along ------------------------------------------------------------------------ */

double fb_moved_mass(const fb_model* model) {
  return model->mass * (1 + model->added_mass_share);
}

double fb_moved_inertia(const fb_model* model) {
  return model->inertia * (1 + model->added_mass_share);
}

/* ---- the water ------------------------------------------------------------------------------- */

static double within(double value, double low, double high) {
  return value < low ? low : value > high ? high : value;
}

static double blend(const double* nodes, int stride, double along, double up) {
  const double below = nodes[0] * (1 - along) + nodes[1] * along;
  const double above = nodes[stride] * (1 - along) + nodes[stride + 1] * along;
  return below * (1 - up) + above * up;
}

/* Bilinear; beyond the grid the value of its edge. */
static void look_up(const fb_model* model, const double* first, const double* second, double x,
                    double y, double* a, double* b) {
  const int columns = model->columns;
  const double column = within((x - model->origin_x) / model->spacing_x, 0, columns - 1);
  const double row = within((y - model->origin_y) / model->spacing_y, 0, model->rows - 1);
  const int i = column < columns - 2 ? (int)column : columns - 2;
  const int j = row < model->rows - 2 ? (int)row : model->rows - 2;
  const ptrdiff_t at = (ptrdiff_t)j * columns + i;
  *a = blend(first + at, columns, column - i, row - j);
  *b = blend(second + at, columns, column - i, row - j);
}

/* What the drag of a windward strip is multiplied with where it does not go with the square. */
static double bend(const fb_model* model, double relative_x, double relative_y) {
  double square;
  if (model->drag_power == 2) {
    return 1;
  }
  square =
      (relative_x * relative_x + relative_y * relative_y) / (model->drag_speed * model->drag_speed);
  return pow(square > 1e-9 ? square : 1e-9, model->drag_power / 2 - 1);
}

fb_push fb_drag(const fb_model* model, const fb_state* state) {
  const double half = model->side / 2, width = model->side / model->strips_per_face;
  const double scale = 0.5 * model->water_density * model->drag_coefficient * width * model->wetted_depth;
  const double linear = model->linear_drag / (4 * model->strips_per_face);
  double normal_x = cos(state->theta), normal_y = sin(state->theta);
  fb_push sum = {0, 0, 0, 0};
  for (int face = 0; face < 4; ++face) {
    for (int strip = 0; strip < model->strips_per_face; ++strip) {
      const double offset = (strip + 0.5) * width - half;
      const double arm_x = half * normal_x - offset * normal_y;
      const double arm_y = half * normal_y + offset * normal_x;
      double u, v;
      look_up(model, model->u, model->v, state->x + arm_x, state->y + arm_y, &u, &v);
      const double relative_x = u - (state->vx - state->omega * arm_y);
      const double relative_y = v - (state->vy + state->omega * arm_x);
      const double closing = -(normal_x * relative_x + normal_y * relative_y);
      double conductance = linear;
      if (closing > 0) {
        conductance += scale * closing * bend(model, relative_x, relative_y);
      }
      const double force_x = conductance * relative_x, force_y = conductance * relative_y;
      sum.x += force_x;
      sum.y += force_y;
      sum.torque += arm_x * force_y - arm_y * force_x;
      sum.conductance += conductance;
    }
    const double turned = normal_x;
    normal_x = -normal_y;
    normal_y = turned;
  }
  return sum;
}

/* The mean of Du/Dt over the block, and its moment, from the 3 x 3 Gauss points of the square. */
static void add_acceleration(const fb_model* model, const fb_state* state, fb_push* push) {
  const double reach = model->side / 2 * sqrt(0.6);
  const double share = model->added_mass_share;
  const double mass = model->displaced_mass + share * model->mass;
  const double inertia =
      model->displaced_mass * model->side * model->side / 6 + share * model->inertia;
  const double cosine = cos(state->theta), sine = sin(state->theta);
  double sum_x = 0, sum_y = 0, spin = 0;
  for (int row = -1; row <= 1; ++row) {
    for (int column = -1; column <= 1; ++column) {
      const double arm_x = reach * (column * cosine - row * sine);
      const double arm_y = reach * (column * sine + row * cosine);
      const double weight = (row == 0 ? 8 : 5) * (column == 0 ? 8 : 5) / 324.0;
      double x, y;
      look_up(model, model->acceleration_x, model->acceleration_y, state->x + arm_x,
              state->y + arm_y, &x, &y);
      sum_x += weight * x;
      sum_y += weight * y;
      spin += weight * (arm_x * y - arm_y * x);
    }
  }
  push->x += mass * sum_x;
  push->y += mass * sum_y;
  push->torque += inertia * 6 / (model->side * model->side) * spin;
}

fb_push fb_water(const fb_model* model, const fb_state* state) {
  fb_push push = fb_drag(model, state);
  if (model->acceleration_x != NULL) {
    add_acceleration(model, state, &push);
  }
  return push;
}

/* ---- the stochastic force -------------------------------------------------------------------- */

/* The finaliser of SplitMix64 (Steele, Lea and Flood, OOPSLA 2014). */
static uint64_t mix(uint64_t value) {
  value += UINT64_C(0x9E3779B97F4A7C15);
  value = (value ^ (value >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
  value = (value ^ (value >> 27)) * UINT64_C(0x94D049BB133111EB);
  return value ^ (value >> 31);
}

void fb_begin_noise(fb_noise* noise, uint64_t seed, uint64_t replicate) {
  const uint64_t trial = 0;
  noise->key = mix(mix(mix(seed) ^ trial) ^ replicate);
  noise->interval = -1;
  noise->share[0] = noise->share[1] = 0;
}

/* Philox 4x32-10 (Salmon et al., SC 2011). */
static void philox(uint64_t key, uint32_t word[4]) {
  uint32_t key0 = (uint32_t)key, key1 = (uint32_t)(key >> 32);
  for (int round = 0; round < 10; ++round) {
    const uint64_t first = (uint64_t)0xD2511F53u * word[0];
    const uint64_t second = (uint64_t)0xCD9E8D57u * word[2];
    word[0] = (uint32_t)(second >> 32) ^ word[1] ^ key0;
    word[1] = (uint32_t)second;
    word[2] = (uint32_t)(first >> 32) ^ word[3] ^ key1;
    word[3] = (uint32_t)first;
    key0 += 0x9E3779B9u;
    key1 += 0xBB67AE85u;
  }
}

/* Two standard normal numbers (Box-Muller); one block of random words serves two intervals. */
static void draw(uint64_t key, int64_t interval, double normal[2]) {
  const uint32_t body = 0, purpose = 1;
  uint32_t word[4] = {(uint32_t)(interval >> 1), body, (uint32_t)(interval >> 33), purpose};
  philox(key, word);
  const uint32_t* pair = word + 2 * (interval & 1);
  const double uniform = ((double)(pair[0] >> 8) + 1) / 16777216.0;
  const double turn =
      (double)(pair[1] >> 30) + (double)((pair[1] >> 8) & 0x3FFFFFu) / 4194304.0 - 0.5;
  const double radius = sqrt(-2 * log(uniform));
  normal[0] = radius * cos(turn * quarter_turn);
  normal[1] = radius * sin(turn * quarter_turn);
}

/* Goes on by one interval. A force that remembers keeps a part of the last one. */
static void go_on(const fb_model* model, fb_noise* noise) {
  const double kept = exp(-model->force_interval / model->force_memory);
  double normal[2];
  noise->interval += 1;
  draw(noise->key, noise->interval, normal);
  for (int axis = 0; axis < 2; ++axis) {
    noise->share[axis] = noise->interval == 0
                             ? sqrt((1 - kept) / (1 + kept)) * normal[axis]
                             : kept * noise->share[axis] + (1 - kept) * normal[axis];
  }
}

void fb_stochastic_force(const fb_model* model, fb_noise* noise, int64_t interval,
                         double force[2]) {
  if (interval != noise->interval && model->force_memory == 0) {
    draw(noise->key, interval, noise->share);
    noise->interval = interval;
  }
  if (interval < noise->interval) {
    noise->interval = -1; /* the simulation has begun anew */
  }
  while (noise->interval < interval) {
    go_on(model, noise);
  }
  force[0] = model->force_std * noise->share[0];
  force[1] = model->force_std * noise->share[1];
}

int64_t fb_interval_at(const fb_model* model, double time) {
  /* The clock of a simulator is a sum of steps: just before a border is on it. */
  return (int64_t)floor(time / model->force_interval + 1e-6);
}

/* ---- step after step ------------------------------------------------------------------------- */

void fb_begin_drive(fb_drive* drive, uint64_t seed, uint64_t replicate) {
  fb_begin_noise(&drive->noise, seed, replicate);
  drive->begun = 0;
  drive->gain_x = drive->gain_y = drive->gain_omega = 0;
}

/* The mean of the stochastic force from half a step before a time to half a step after it. */
static void force_around(const fb_model* model, fb_drive* drive, double time, double step,
                         double force[2]) {
  const int64_t now = fb_interval_at(model, time);
  const int64_t before = drive->begun ? fb_interval_at(model, time - step / 2) : now;
  double earlier[2];
  fb_stochastic_force(model, &drive->noise, before, earlier);
  fb_stochastic_force(model, &drive->noise, now, force);
  force[0] = (force[0] + earlier[0]) / 2;
  force[1] = (force[1] + earlier[1]) / 2;
}

fb_push fb_drive_step(const fb_model* model, fb_drive* drive, const fb_state* state, double time,
                      double step) {
  const double share = drive->begun ? 1 : 0.5;
  fb_state now = *state;
  now.vx += step / 2 * drive->gain_x;
  now.vy += step / 2 * drive->gain_y;
  now.omega += step / 2 * drive->gain_omega;
  fb_push push = fb_water(model, &now);
  double force[2];
  force_around(model, drive, time, step, force);
  push.x += force[0];
  push.y += force[1];
  push.conductance = 0;
  drive->gain_x = push.x / fb_moved_mass(model);
  drive->gain_y = push.y / fb_moved_mass(model);
  drive->gain_omega = push.torque / fb_moved_inertia(model);
  drive->begun = 1;
  push.x *= share;
  push.y *= share;
  push.torque *= share;
  return push;
}
