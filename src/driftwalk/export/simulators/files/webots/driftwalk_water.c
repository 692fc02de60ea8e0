/* Webots physics plugin: the water acts on the block, and the stochastic force.
 *
 * The forces are those of floating_block.c, added before every step of the engine.
 */
#include <ode/ode.h>
#include <plugins/physics.h>

#include "floating_block.h"

#include <math.h>
#include <stddef.h>

static const uint64_t replicate = 0; /* another number: another run with the same seed */

static dBodyID block = NULL;
static fb_drive drive;
static double begin_ms, last_ms;

static void begin(double now_ms) {
  begin_ms = last_ms = now_ms;
  fb_begin_drive(&drive, floating_block_model.seed, replicate);
}

void webots_physics_init() {
  block = dWebotsGetBodyFromDEF("BLOCK");
  if (block == NULL) {
    dWebotsConsolePrintf("driftwalk_water: the world has no solid DEF BLOCK\n");
    return;
  }
  /* Slow drift is no rest. */
  dBodySetAutoDisableFlag(block, 0);
  dBodyEnable(block);
  begin(HUGE_VAL);
}

static fb_state state_of(dBodyID body) {
  const dReal* position = dBodyGetPosition(body);
  const dReal* rotation = dBodyGetRotation(body); /* rows of four */
  const dReal* velocity = dBodyGetLinearVel(body);
  const fb_state state = {position[0], position[1], atan2(rotation[4], rotation[0]),
                          velocity[0], velocity[1], dBodyGetAngularVel(body)[2]};
  return state;
}

/* Contacts at the upper and the lower edge of a block differ in the last digits. */
static void keep_in_plane(dBodyID body) {
  const dReal* velocity = dBodyGetLinearVel(body);
  dBodySetLinearVel(body, velocity[0], velocity[1], 0);
  dBodySetAngularVel(body, 0, 0, dBodyGetAngularVel(body)[2]);
}

void webots_physics_step() {
  const fb_model* model = &floating_block_model;
  const double now_ms = dWebotsGetTime();
  if (block == NULL) {
    return;
  }
  if (now_ms < last_ms) {
    begin(now_ms); /* the first step, or the simulation was reset */
  }
  keep_in_plane(block);
  const fb_state state = state_of(block);
  const fb_push push =
      fb_drive_step(model, &drive, &state, (now_ms - begin_ms) / 1000, (now_ms - last_ms) / 1000);
  last_ms = now_ms;
  dBodyAddForce(block, push.x, push.y, 0);
  dBodyAddTorque(block, 0, 0, push.torque);
}

int webots_physics_collide(dGeomID first, dGeomID second) {
  (void)first;
  (void)second;
  return 0; /* Webots makes the contacts */
}

void webots_physics_cleanup() {
  block = NULL;
}
