/* The force on a floating square block, as driftwalk computes it: plain C99, no library but libm.
 *
 * SI units; angles in rad, counter-clockwise; the frame is that of the tank's centre.
 */
#ifndef FLOATING_BLOCK_H
#define FLOATING_BLOCK_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The model that was exported; `floating_block_model` in model_data.c. */
typedef struct {
  double side, mass, inertia; /* of the block alone */
  double added_mass_share;    /* of mass and inertia, moves along with the block */
  double wetted_depth;        /* of the sides */
  int strips_per_face;
  double water_density;
  double drag_coefficient;
  double linear_drag;            /* kg/s, of all strips together */
  double drag_power, drag_speed; /* power of the speed; speed at which the coefficient holds */
  double displaced_mass;         /* 0: water that accelerates does not push */
  double force_std, force_interval, force_memory; /* N, s, s */
  double time_step;                               /* of driftwalk */
  uint64_t seed;
  /* Nodes of the flow, row after row from below: velocity, and acceleration or NULL. */
  int columns, rows;
  double origin_x, origin_y, spacing_x, spacing_y;
  const double *u, *v;
  const double *acceleration_x, *acceleration_y;
} fb_model;

extern const fb_model floating_block_model;

typedef struct {
  double x, y, theta;
  double vx, vy, omega;
} fb_state;

typedef struct {
  double x, y, torque; /* N, N, N m */
  double conductance;  /* kg/s: how strongly the drag damps motion */
} fb_push;

/* The mass and the moment of inertia that the simulator has to move. */
double fb_moved_mass(const fb_model* model);
double fb_moved_inertia(const fb_model* model);

/* The drag on the strips of the four side faces. */
fb_push fb_drag(const fb_model* model, const fb_state* state);

/* Everything that the water does: the drag, and the push of water that accelerates. */
fb_push fb_water(const fb_model* model, const fb_state* state);

/* The stochastic force: held for an interval, a function of seed, replicate and interval alone. */
typedef struct {
  uint64_t key;
  int64_t interval; /* the last that was asked for; -1: none */
  double share[2];  /* its force over the standard deviation */
} fb_noise;

void fb_begin_noise(fb_noise* noise, uint64_t seed, uint64_t replicate);

/* The force of an interval [N]; the first interval, from 0 s on, is number 0. */
void fb_stochastic_force(const fb_model* model, fb_noise* noise, int64_t interval, double force[2]);

/* The interval that a step belongs to which begins at a time [s]. */
int64_t fb_interval_at(const fb_model* model, double time);

/* The forces of one step after the other, for a simulator that changes the velocity and then moves
 * by the new one, as ODE, DART and Bullet do. Taken plainly that is of first order in the step.
 * Here its velocity is taken as that of half a step ago (leapfrog), which is of second order: the
 * first step gets half of its force.
 */
typedef struct {
  fb_noise noise;
  int begun;
  double gain_x, gain_y, gain_omega; /* acceleration in the last step */
} fb_drive;

void fb_begin_drive(fb_drive* drive, uint64_t seed, uint64_t replicate);

/* What to add to the body in the step from a time on, of the length `step` [s]; the state is that
 * of the simulator. The conductance is 0. */
fb_push fb_drive_step(const fb_model* model, fb_drive* drive, const fb_state* state, double time,
                      double step);

#ifdef __cplusplus
}
#endif

#endif
