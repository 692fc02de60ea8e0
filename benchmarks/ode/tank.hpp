// Floating blocks in a stirred tank on the Open Dynamics Engine; shares no code with driftwalk.
//
// The same physics as driftwalk's worlds without latching, written the usual way for an engine:
// force and torque of the strips are summed by hand and handed to each body, then the world makes
// one step. Worlds run one after another. The wall is either an impulse computed by hand at the
// corners ("impulse": ODE only integrates), or 64 static boxes in a ring that ODE collides the
// blocks with ("boxes"). Blocks collide with each other as ODE's boxes, with the restitution of the
// wall and no friction.
//
// CASE holds numbers divided by white space: side, mass, depth, water density, radius, restitution,
// friction, bounce speed, time step, steps per sample; nodes per axis, first node, spacing, all
// u row by row, all v; worlds, blocks in each, and for each block x, y, theta, vx, vy, omega, C_d,
// sigma_F.
#pragma once

#include <ode/ode.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <vector>

inline constexpr int strips = 8;
inline constexpr int wall_boxes = 64;
inline constexpr int most_contacts = 8;
inline constexpr double pi = 3.14159265358979323846;

struct Start {
  double x, y, theta, vx, vy, omega, drag_coefficient, force_std;
};

// How the world differs from driftwalk's model; as it stands, not at all.
struct Law {
  double added_mass = 0;        // as a share of the block's mass; of its inertia alike
  double pressure_gradient = 0; // 1: the water's acceleration pushes the block and its added mass
  double water_spin = 0;        // 1: its curl turns them, as rigid water would be turned
  double linear_drag = 0;       // [kg/s], of the whole block; each strip of any face has its part
  double drag_power = 2;        // of the speed; the drag is that of C_d at 3 cm/s
  double flow_growth = 0;       // of the flow's strength a second, as a share of that at the start
  double pulse = 0;             // amplitude of its pulses, as a share
  double pulse_period = 10;     // [s]
  double disc = 0;              // 1: a disc of diameter `side`, no block
};
inline constexpr double reference_speed = 0.03; // [m/s]

struct Case {
  Law law;
  double side, mass, depth, density, radius, restitution, friction, bounce_speed, dt;
  int period;
  int nodes;
  double origin, spacing;
  std::vector<double> u, v;
  std::size_t worlds, blocks;
  std::vector<Start> starts; // block by block, world by world
};

inline Case read_case(const char* path) {
  std::ifstream in(path);
  Case c;
  in >> c.side >> c.mass >> c.depth >> c.density >> c.radius >> c.restitution >> c.friction >>
      c.bounce_speed >> c.dt >> c.period >> c.nodes >> c.origin >> c.spacing;
  c.u.resize(static_cast<std::size_t>(c.nodes) * c.nodes);
  c.v.resize(c.u.size());
  for (double& value : c.u) {
    in >> value;
  }
  for (double& value : c.v) {
    in >> value;
  }
  in >> c.worlds >> c.blocks;
  c.starts.resize(c.worlds * c.blocks);
  for (Start& s : c.starts) {
    in >> s.x >> s.y >> s.theta >> s.vx >> s.vy >> s.omega >> s.drag_coefficient >> s.force_std;
  }
  if (!in) {
    std::cerr << "cannot read the case " << path << "\n";
    std::exit(2);
  }
  return c;
}

struct Planar {
  double x, y;
};

inline Planar flow_at(const Case& c, double x, double y) {
  const double last = c.nodes - 1.000001;
  const double column = std::clamp((x - c.origin) / c.spacing, 0.0, last);
  const double row = std::clamp((y - c.origin) / c.spacing, 0.0, last);
  const int i = static_cast<int>(column), j = static_cast<int>(row);
  const double fx = column - i, fy = row - j;
  const std::size_t at = static_cast<std::size_t>(j) * c.nodes + i, up = at + c.nodes;
  const double w00 = (1 - fx) * (1 - fy), w10 = fx * (1 - fy), w01 = (1 - fx) * fy, w11 = fx * fy;
  return {w00 * c.u[at] + w10 * c.u[at + 1] + w01 * c.u[up] + w11 * c.u[up + 1],
          w00 * c.v[at] + w10 * c.v[at + 1] + w01 * c.v[up] + w11 * c.v[up + 1]};
}

// (u . grad) u in the middle of the block: what the water's own acceleration is in a steady flow.
inline Planar acceleration_at(const Case& c, double x, double y) {
  const double h = c.spacing;
  const Planar here = flow_at(c, x, y);
  const Planar right = flow_at(c, x + h, y), left = flow_at(c, x - h, y);
  const Planar above = flow_at(c, x, y + h), below = flow_at(c, x, y - h);
  return {(here.x * (right.x - left.x) + here.y * (above.x - below.x)) / (2 * h),
          (here.x * (right.y - left.y) + here.y * (above.y - below.y)) / (2 * h)};
}

// What the water's own acceleration does to a block that it carries along: its mean over the block,
// and the spin that the block gains [rad/s^2]. Taken on a lattice that turns with the block.
struct Carried {
  Planar acceleration;
  double spin_gain;
};

inline Carried carried_at(const Case& c, double x, double y, double cosine, double sine) {
  constexpr int points = 4;
  Carried sum{{0, 0}, 0};
  double square = 0;
  for (int i = 0; i < points; ++i) {
    for (int j = 0; j < points; ++j) {
      const double a = ((i + 0.5) / points - 0.5) * c.side, b = ((j + 0.5) / points - 0.5) * c.side;
      const double rx = a * cosine - b * sine, ry = a * sine + b * cosine;
      const Planar here = acceleration_at(c, x + rx, y + ry);
      sum.acceleration.x += here.x / (points * points);
      sum.acceleration.y += here.y / (points * points);
      sum.spin_gain += rx * here.y - ry * here.x;
      square += rx * rx + ry * ry;
    }
  }
  sum.spin_gain /= square;
  return sum;
}

inline double strength_at(const Law& law, double time) {
  return 1 + law.flow_growth * time + law.pulse * std::sin(2 * pi * time / law.pulse_period);
}

struct State {
  double x, y, cosine, sine, vx, vy, omega;
};

inline State state_of(dBodyID body) {
  const dReal* p = dBodyGetPosition(body);
  const dReal* r = dBodyGetRotation(body); // rows of four
  const dReal* v = dBodyGetLinearVel(body);
  return {p[0], p[1], r[0], r[4], v[0], v[1], dBodyGetAngularVel(body)[2]};
}

struct Wrench {
  double x, y, torque;
};

// What the drag of a strip is multiplied with where it does not go with the square of the speed.
inline double bend(const Law& law, double wx, double wy) {
  if (law.drag_power == 2) {
    return 1;
  }
  return std::pow(std::hypot(wx, wy) / reference_speed, law.drag_power - 2);
}

inline Wrench drag(const Case& c, double drag_coefficient, const State& s, double strength) {
  const double half = c.side / 2, width = c.side / strips;
  const double scale = 0.5 * c.density * drag_coefficient * width * c.depth;
  const double linear = c.law.linear_drag / (4 * strips);
  Wrench sum{0, 0, 0};
  double nx = s.cosine, ny = s.sine;
  for (int face = 0; face < 4; ++face) {
    for (int k = 0; k < strips; ++k) {
      const double offset = (k + 0.5) * width - half;
      const double rx = nx * half - ny * offset, ry = ny * half + nx * offset;
      const Planar water = flow_at(c, s.x + rx, s.y + ry);
      const double wx = strength * water.x - (s.vx - s.omega * ry);
      const double wy = strength * water.y - (s.vy + s.omega * rx);
      const double facing = -(nx * wx + ny * wy);
      const double windward = facing > 0 ? scale * facing * bend(c.law, wx, wy) : 0;
      const double size = linear + windward;
      const double fx = size * wx, fy = size * wy;
      sum.x += fx;
      sum.y += fy;
      sum.torque += rx * fy - ry * fx;
    }
    const double turned = nx;
    nx = -ny;
    ny = turned;
  }
  return sum;
}

// The same of a disc, whose rim is many strips. Its spin is not in the force: it only brakes.
inline Wrench disc_drag(const Case& c, double drag_coefficient, const State& s, double strength) {
  constexpr int rim = 101;
  const double radius = c.side / 2;
  const double scale = 0.5 * c.density * drag_coefficient * c.depth * 2 * pi * radius / rim;
  Wrench sum{0, 0, 0};
  for (int k = 0; k < rim; ++k) {
    const double nx = std::cos(2 * pi * k / rim), ny = std::sin(2 * pi * k / rim);
    const Planar water = flow_at(c, s.x + radius * nx, s.y + radius * ny);
    const double wx = strength * water.x - s.vx, wy = strength * water.y - s.vy;
    const double size = scale * std::max(-(nx * wx + ny * wy), 0.0);
    sum.x += size * wx;
    sum.y += size * wy;
    sum.torque += size * radius * (nx * wy - ny * wx - s.omega * radius);
  }
  return sum;
}

// Impulse where the rim of a disc is beyond the circle, and the disc moved back inside.
inline void meet_circle_with_rim(const Case& c, dBodyID body) {
  State s = state_of(body);
  const double radius = c.side / 2, distance = std::hypot(s.x, s.y);
  if (distance + radius <= c.radius) {
    return;
  }
  const double nx = s.x / distance, ny = s.y / distance;
  const double closing = s.vx * nx + s.vy * ny;
  if (closing > 0) {
    const double push = closing * (1 + (closing > c.bounce_speed ? c.restitution : 0));
    const double sliding = s.vy * nx - s.vx * ny + s.omega * radius;
    // At the rim the disc weighs a third: R² m / I = 2.
    const double rub = std::clamp(-sliding / 3, -c.friction * push, c.friction * push);
    s.vx -= push * nx + rub * ny;
    s.vy -= push * ny - rub * nx;
    s.omega += 2 * rub / radius;
  }
  const double back = distance + radius - c.radius;
  dBodySetPosition(body, s.x - back * nx, s.y - back * ny, 0);
  dBodySetLinearVel(body, s.vx, s.vy, 0);
  dBodySetAngularVel(body, 0, 0, s.omega);
}

// Impulses at the corners beyond the circle, and the block moved back inside.
inline void meet_circle(const Case& c, dBodyID body) {
  State s = state_of(body);
  const double half = c.side / 2, reach = std::sqrt(2.0) * half;
  const double inner = c.radius - reach;
  if (s.x * s.x + s.y * s.y < inner * inner) {
    return;
  }
  const double per_inertia = 6 / (c.side * c.side); // mass / inertia
  bool touched = false;
  for (int corner = 0; corner < 4; ++corner) {
    const double a = corner & 1 ? half : -half, b = corner & 2 ? half : -half;
    const double rx = a * s.cosine - b * s.sine, ry = a * s.sine + b * s.cosine;
    const double distance = std::hypot(s.x + rx, s.y + ry);
    if (distance <= c.radius) {
      continue;
    }
    touched = true;
    const double nx = (s.x + rx) / distance, ny = (s.y + ry) / distance;
    const double closing = (s.vx - s.omega * ry) * nx + (s.vy + s.omega * rx) * ny;
    if (closing > 0) {
      const double lever = rx * ny - ry * nx, bounce = closing > c.bounce_speed ? c.restitution : 0;
      const double push = closing * (1 + bounce) / (1 + lever * lever * per_inertia);
      s.vx -= push * nx;
      s.vy -= push * ny;
      s.omega -= push * lever * per_inertia;
      const double arm = rx * nx + ry * ny;
      const double sliding = (s.vy + s.omega * rx) * nx - (s.vx - s.omega * ry) * ny;
      const double stop = -sliding / (1 + arm * arm * per_inertia);
      const double rub = std::clamp(stop, -c.friction * push, c.friction * push);
      s.vx -= rub * ny;
      s.vy += rub * nx;
      s.omega += rub * arm * per_inertia;
    }
    s.x -= nx * (distance - c.radius);
    s.y -= ny * (distance - c.radius);
  }
  if (touched) {
    dBodySetPosition(body, s.x, s.y, 0);
    dBodySetLinearVel(body, s.vx, s.vy, 0);
    dBodySetAngularVel(body, 0, 0, s.omega);
  }
}

class Tank {
public:
  Tank(const Case& c, bool boxes)
      : c_(c), boxes_(boxes), collides_(boxes || c.blocks > 1), world_(dWorldCreate()),
        contacts_(dJointGroupCreate(0)), blocks_(dSimpleSpaceCreate(nullptr)) {
    dWorldSetGravity(world_, 0, 0, 0);
    dMass mass;
    const double moved = c.mass * (1 + c.law.added_mass);
    if (c.law.disc != 0) {
      dMassSetCylinderTotal(&mass, moved, 3, c.side / 2, c.side);
    } else {
      dMassSetBoxTotal(&mass, moved, c.side, c.side, c.side);
    }
    for (std::size_t b = 0; b < c.blocks; ++b) {
      const dBodyID body = dBodyCreate(world_);
      dBodySetMass(body, &mass);
      bodies_.push_back(body);
      if (collides_) {
        dGeomSetBody(dCreateBox(blocks_, c.side, c.side, c.side), body);
        dJointAttach(dJointCreatePlane2D(world_, nullptr), body, nullptr);
      }
    }
    if (boxes_) {
      build_wall();
    }
  }
  ~Tank() {
    if (boxes_) {
      dSpaceDestroy(wall_);
    }
    dSpaceDestroy(blocks_);
    dJointGroupDestroy(contacts_);
    dWorldDestroy(world_);
  }
  Tank(const Tank&) = delete;
  Tank& operator=(const Tank&) = delete;

  void place(const Start* start) {
    for (const dBodyID body : bodies_) {
      dMatrix3 rotation;
      dRFromAxisAndAngle(rotation, 0, 0, 1, start->theta);
      dBodySetPosition(body, start->x, start->y, 0);
      dBodySetRotation(body, rotation);
      dBodySetLinearVel(body, start->vx, start->vy, 0);
      dBodySetAngularVel(body, 0, 0, start->omega);
      ++start;
    }
  }

  template <class Noise>
  void step(const Start* start, Noise& noise) {
    const double strength = strength_at(c_.law, time_);
    time_ += c_.dt;
    for (const dBodyID body : bodies_) {
      const State s = state_of(body);
      const Wrench w = c_.law.disc != 0 ? disc_drag(c_, start->drag_coefficient, s, strength)
                                        : drag(c_, start->drag_coefficient, s, strength);
      if (c_.law.pressure_gradient != 0 || c_.law.water_spin != 0) {
        const Carried push = carried_at(c_, s.x, s.y, s.cosine, s.sine);
        const double mass = c_.mass * (1 + c_.law.added_mass) * strength * strength;
        const double force = mass * c_.law.pressure_gradient;
        const double torque = mass * c_.side * c_.side / 6 * c_.law.water_spin;
        dBodyAddForce(body, force * push.acceleration.x, force * push.acceleration.y, 0);
        dBodyAddTorque(body, 0, 0, torque * push.spin_gain);
      }
      const double noise_x = noise() * start->force_std, noise_y = noise() * start->force_std;
      dBodyAddForce(body, w.x + noise_x, w.y + noise_y, 0);
      dBodyAddTorque(body, 0, 0, w.torque);
      ++start;
    }
    if (boxes_) {
      dSpaceCollide2(reinterpret_cast<dGeomID>(blocks_), reinterpret_cast<dGeomID>(wall_), this,
                     &Tank::near);
    }
    if (bodies_.size() > 1) {
      dSpaceCollide(blocks_, this, &Tank::near);
    }
    dWorldQuickStep(world_, c_.dt);
    dJointGroupEmpty(contacts_);
    if (!boxes_) {
      for (const dBodyID body : bodies_) {
        if (c_.law.disc != 0) {
          meet_circle_with_rim(c_, body);
        } else {
          meet_circle(c_, body);
        }
      }
    }
  }

  State state(std::size_t block) const { return state_of(bodies_[block]); }

private:
  void build_wall() {
    wall_ = dHashSpaceCreate(nullptr);
    const double thick = c_.radius / 4;
    const double length = 2 * (c_.radius + thick) * std::tan(pi / wall_boxes);
    for (int k = 0; k < wall_boxes; ++k) {
      const double angle = 2 * pi * k / wall_boxes, at = c_.radius + thick / 2;
      const dGeomID box = dCreateBox(wall_, thick, length, 4 * c_.side);
      dMatrix3 rotation;
      dRFromAxisAndAngle(rotation, 0, 0, 1, angle);
      dGeomSetPosition(box, at * std::cos(angle), at * std::sin(angle), 0);
      dGeomSetRotation(box, rotation);
    }
  }

  static void near(void* data, dGeomID a, dGeomID b) {
    auto& tank = *static_cast<Tank*>(data);
    const bool at_wall = dGeomGetBody(a) == nullptr || dGeomGetBody(b) == nullptr;
    dContact contact[most_contacts];
    const int found = dCollide(a, b, most_contacts, &contact[0].geom, sizeof(dContact));
    for (int k = 0; k < found; ++k) {
      contact[k].surface = {};
      contact[k].surface.mode = dContactBounce | dContactApprox1;
      contact[k].surface.mu = at_wall ? tank.c_.friction : 0;
      contact[k].surface.bounce = tank.c_.restitution;
      contact[k].surface.bounce_vel = tank.c_.bounce_speed;
      dJointAttach(dJointCreateContact(tank.world_, tank.contacts_, &contact[k]),
                   dGeomGetBody(contact[k].geom.g1), dGeomGetBody(contact[k].geom.g2));
    }
  }

  const Case& c_;
  double time_ = 0;
  bool boxes_, collides_;
  dWorldID world_;
  dJointGroupID contacts_;
  dSpaceID blocks_, wall_ = nullptr;
  std::vector<dBodyID> bodies_;
};
