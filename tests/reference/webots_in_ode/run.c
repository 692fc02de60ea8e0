/* Stands in for Webots: one body of ODE, and the plugin's functions called as Webots calls them.
 *
 *     run MASS INERTIA STEP_MS STEPS_PER_SAMPLE SAMPLES X Y THETA
 *
 * Prints x, y, theta of each sample.
 */
#include <ode/ode.h>
#include <plugins/physics.h>

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static dBodyID block;
static double time_ms = 0;

dBodyID dWebotsGetBodyFromDEF(const char* name) {
  return strcmp(name, "BLOCK") == 0 ? block : NULL;
}

void dWebotsConsolePrintf(const char* format, ...) {
  va_list arguments;
  va_start(arguments, format);
  vfprintf(stderr, format, arguments);
  va_end(arguments);
}

double dWebotsGetTime() {
  return time_ms;
}

int main(int argc, char** argv) {
  if (argc != 9) {
    fprintf(stderr, "usage: run MASS INERTIA STEP_MS STEPS_PER_SAMPLE SAMPLES X Y THETA\n");
    return 2;
  }
  const double inertia = atof(argv[2]), step_ms = atof(argv[3]);
  const int steps = atoi(argv[4]), samples = atoi(argv[5]);
  dInitODE();
  const dWorldID world = dWorldCreate();
  dWorldSetGravity(world, 0, 0, 0);
  block = dBodyCreate(world);
  dMass mass;
  dMassSetParameters(&mass, atof(argv[1]), 0, 0, 0, inertia, inertia, inertia, 0, 0, 0);
  dBodySetMass(block, &mass);
  dMatrix3 rotation;
  dRFromAxisAndAngle(rotation, 0, 0, 1, atof(argv[8]));
  dBodySetPosition(block, atof(argv[6]), atof(argv[7]), 0);
  dBodySetRotation(block, rotation);
  webots_physics_init();
  for (int sample = 0; sample < samples; ++sample) {
    const dReal* position = dBodyGetPosition(block);
    const dReal* turned = dBodyGetRotation(block);
    printf("%.17g %.17g %.17g\n", position[0], position[1], atan2(turned[4], turned[0]));
    for (int k = 0; k < steps; ++k) {
      webots_physics_step();
      dWorldStep(world, step_ms / 1000);
      time_ms += step_ms;
    }
  }
  webots_physics_cleanup();
  dWorldDestroy(world);
  dCloseODE();
  return 0;
}
