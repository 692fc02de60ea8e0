/* What the physics plugin of an export asks of Webots, declared as Webots declares it. */
#ifndef PHYSICS_H
#define PHYSICS_H

#include <ode/ode.h>

void webots_physics_init();
void webots_physics_step();
int webots_physics_collide(dGeomID, dGeomID);
void webots_physics_cleanup();

dBodyID dWebotsGetBodyFromDEF(const char* name);
void dWebotsConsolePrintf(const char* format, ...);
double dWebotsGetTime();

#endif
