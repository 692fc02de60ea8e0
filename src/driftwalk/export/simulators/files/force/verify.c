/* Holds the force code of this export to driftwalk, without any simulator.
 *
 *     verify reference.txt
 *
 * Takes driftwalk's own time step, with the forces of floating_block.c, along paths that driftwalk
 * has computed, and compares single forces. Prints one line of JSON; exit code 0 where all is the
 * same, 1 where it is not, 2 where the file cannot be read.
 */
#include "floating_block.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static const double farthest = 1e-9;       /* m, of a path from driftwalk's */
static const double largest_error = 1e-10; /* of a force, relative */

typedef struct {
  double x, y, theta;
} triple;

typedef struct {
  fb_state state;
  triple drag; /* acceleration by the water in the last step */
} body;

static double number(FILE* file) {
  double value;
  if (fscanf(file, "%lf", &value) != 1) {
    fprintf(stderr, "verify: the reference ends early or holds something that is no number\n");
    exit(2);
  }
  return value;
}

/* driftwalk's time step: second order, with a single evaluation of the force. */
static void step(const fb_model* model, body* block, const double force[2]) {
  const double dt = model->time_step;
  const double mass = fb_moved_mass(model), inertia = fb_moved_inertia(model);
  const double noise_x = force[0] / mass, noise_y = force[1] / mass;
  const fb_state* now = &block->state;
  fb_state ahead;
  ahead.vx = now->vx + dt / 2 * (block->drag.x + noise_x);
  ahead.vy = now->vy + dt / 2 * (block->drag.y + noise_y);
  ahead.omega = now->omega + dt / 2 * block->drag.theta;
  ahead.x = now->x + dt / 4 * (now->vx + ahead.vx);
  ahead.y = now->y + dt / 4 * (now->vy + ahead.vy);
  ahead.theta = now->theta + dt / 4 * (now->omega + ahead.omega);
  const fb_push push = fb_water(model, &ahead);
  const double damping = 1 + dt / 2 * push.conductance / mass;
  const double spin_damping =
      1 + dt / 2 * push.conductance * model->side * model->side / 3 / inertia;
  const double mean_x = ahead.vx + dt / 2 * (push.x / mass - block->drag.x) / damping;
  const double mean_y = ahead.vy + dt / 2 * (push.y / mass - block->drag.y) / damping;
  const double mean_omega =
      ahead.omega + dt / 2 * (push.torque / inertia - block->drag.theta) / spin_damping;
  const fb_state after = {now->x + dt * mean_x, now->y + dt * mean_y, now->theta + dt * mean_omega,
                          2 * mean_x - now->vx, 2 * mean_y - now->vy, 2 * mean_omega - now->omega};
  block->drag.x = (after.vx - now->vx) / dt - noise_x;
  block->drag.y = (after.vy - now->vy) / dt - noise_y;
  block->drag.theta = (after.omega - now->omega) / dt;
  block->state = after;
}

/* The largest distance from a path of the file [m]. */
static double follow(FILE* file, const fb_model* model) {
  const int noisy = (int)number(file);
  const uint64_t replicate = (uint64_t)number(file);
  const int samples = (int)number(file), steps = (int)number(file);
  const int steps_per_interval = (int)(model->force_interval / model->time_step + 0.5);
  double largest = 0, force[2] = {0, 0};
  long taken = 0;
  fb_noise noise;
  body block = {{0, 0, 0, 0, 0, 0}, {0, 0, 0}};
  fb_begin_noise(&noise, model->seed, replicate);
  for (int sample = 0; sample < samples; ++sample) {
    const double x = number(file), y = number(file), theta = number(file);
    if (sample == 0) {
      block.state.x = x;
      block.state.y = y;
      block.state.theta = theta;
      continue;
    }
    for (int k = 0; k < steps; ++k, ++taken) {
      if (noisy) {
        fb_stochastic_force(model, &noise, taken / steps_per_interval, force);
      }
      step(model, &block, force);
    }
    largest = fmax(largest, hypot(block.state.x - x, block.state.y - y));
  }
  return largest;
}

/* The relative error of one force of the file, over its size or that of the torque. */
static double compare(FILE* file, const fb_model* model) {
  fb_state state;
  state.x = number(file);
  state.y = number(file);
  state.theta = number(file);
  state.vx = number(file);
  state.vy = number(file);
  state.omega = number(file);
  const double x = number(file), y = number(file), torque = number(file);
  const fb_push drag = fb_drag(model, &state);
  const double size = hypot(x, y), lever = fabs(torque) + size * model->side;
  if (size == 0) {
    return hypot(drag.x, drag.y);
  }
  return fmax(hypot(drag.x - x, drag.y - y) / size, fabs(drag.torque - torque) / lever);
}

int main(int argc, char** argv) {
  const fb_model* model = &floating_block_model;
  FILE* file = argc == 2 ? fopen(argv[1], "r") : NULL;
  if (file == NULL) {
    fprintf(stderr, "usage: verify reference.txt\n");
    return 2;
  }
  double error = 0, distance = 0;
  const int forces = (int)number(file);
  for (int k = 0; k < forces; ++k) {
    error = fmax(error, compare(file, model));
  }
  const int paths = (int)number(file);
  for (int k = 0; k < paths; ++k) {
    distance = fmax(distance, follow(file, model));
  }
  fclose(file);
  printf("{\"forces\": %d, \"largest_relative_error\": %.3g, \"paths\": %d, "
         "\"largest_distance_m\": %.3g}\n",
         forces, error, paths, distance);
  return error < largest_error && distance < farthest ? 0 : 1;
}
