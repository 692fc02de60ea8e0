// Runs the system plugin of an export: the stand-in's one link, moved as Gazebo's engine moves it,
// which changes the velocity and then moves by the new one.
//
//     run MASS INERTIA STEP_S STEPS_PER_SAMPLE SAMPLES X Y THETA
//
// Prints x, y, theta of each sample.
#include "driftwalk_water.cc"

#include <cstdio>
#include <cstdlib>

int main(int argc, char** argv) {
  if (argc != 9) {
    std::fprintf(stderr, "usage: run MASS INERTIA STEP_S STEPS_PER_SAMPLE SAMPLES X Y THETA\n");
    return 2;
  }
  const double mass = std::atof(argv[1]), inertia = std::atof(argv[2]), step = std::atof(argv[3]);
  const int steps = std::atoi(argv[4]), samples = std::atoi(argv[5]);
  gz::sim::EntityComponentManager link{};
  link.x = std::atof(argv[6]);
  link.y = std::atof(argv[7]);
  link.yaw = std::atof(argv[8]);
  StandInPlugin plugin;
  gz::sim::EventManager events;
  plugin.Configure(1, std::make_shared<sdf::Element>(), link, events);
  gz::sim::UpdateInfo info;
  info.dt = std::chrono::duration_cast<std::chrono::steady_clock::duration>(
      std::chrono::duration<double>(step));
  for (int sample = 0; sample < samples; ++sample) {
    std::printf("%.17g %.17g %.17g\n", link.x, link.y, link.yaw);
    for (int k = 0; k < steps; ++k) {
      link.force_x = link.force_y = link.torque = 0;
      info.simTime += info.dt;
      plugin.PreUpdate(info, link);
      link.vx += step * link.force_x / mass;
      link.vy += step * link.force_y / mass;
      link.spin += step * link.torque / inertia;
      link.x += step * link.vx;
      link.y += step * link.vy;
      link.yaw += step * link.spin;
    }
  }
  return 0;
}
