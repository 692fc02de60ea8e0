// Impacts by hand, and what must hold at any: no energy gained, no corner left outside, friction
// within Coulomb's bound.
#include "check.hpp"
#include "driftwalk/physics/wall.hpp"
#include "synthetic_tank.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>

namespace {

using driftwalk::FloatPack;
using driftwalk::Motion;
using driftwalk::Pose;
using driftwalk::PreparedEdge;
using driftwalk::WallView;
using Pack = FloatPack<4>;

constexpr double half = 0.015;
constexpr double per_inertia = 6 / (4 * half * half); // m / I of a square
const double pi = std::acos(-1.0);

WallView<double> circle(double restitution, double friction) {
  return {0.15, nullptr, 0, restitution, friction, 0.01};
}

double energy(const Motion<double>& m) {
  return (m.vx * m.vx + m.vy * m.vy + m.omega * m.omega / per_inertia) / 2;
}

// How far the farthest corner is outside [m].
double deepest(const WallView<double>& wall, const Pose<double>& pose) {
  double depth = -1;
  for (int corner = 0; corner < 4; ++corner) {
    const double angle = pose.theta + (corner + 0.5) * pi / 2;
    const double x = pose.x + half * std::sqrt(2.0) * std::cos(angle);
    const double y = pose.y + half * std::sqrt(2.0) * std::sin(angle);
    if (wall.edge_count == 0) {
      depth = std::max(depth, std::hypot(x, y) - wall.radius);
    }
    for (int e = 0; e < wall.edge_count; ++e) {
      const PreparedEdge<double>& edge = wall.edges[e];
      depth = std::max(depth, x * edge.normal_x + y * edge.normal_y - edge.distance);
    }
  }
  return depth;
}

const PreparedEdge<double> right_wall[] = {{1, 0, 0.1}};
WallView<double> straight(double restitution, double friction) {
  return {0, right_wall, 1, restitution, friction, 0.01};
}

// One corner ahead: the textbook impulse J = (1 + e) v_n / (1/m + l^2/I).
void check_single_corner() {
  for (const double speed : {0.05, 0.0101, 0.0099, 0.001}) {
    const double theta = 0.3, e = speed > 0.01 ? 0.5 : 0.0;
    const double lever = half * (std::cos(theta) - std::sin(theta)); // arm of the leading corner, y
    const double arm_x = half * (std::cos(theta) + std::sin(theta));
    Pose<double> pose{0.1 - arm_x + 1e-4, 0.02, theta};
    Motion<double> motion{speed, 0.03, 0};
    // The leading corner is the one at (h, -h) turned by theta.
    const double arm_y = half * (std::sin(theta) - std::cos(theta));
    CHECK_NEAR(std::fabs(arm_y), lever, 1e-15);
    CHECK(driftwalk::meet_wall(straight(0.5, 0), half, per_inertia, pose, motion));
    const double push = (1 + e) * speed / (1 + arm_y * arm_y * per_inertia);
    CHECK_NEAR(motion.vx, speed - push, 1e-15);
    CHECK_NEAR(motion.vy, 0.03, 1e-15);
    CHECK_NEAR(motion.omega, arm_y * push * per_inertia, 1e-12);
    CHECK_NEAR(motion.vx - motion.omega * arm_y, -e * speed, 1e-15);
    CHECK_NEAR(pose.x, 0.1 - arm_x, 1e-15);
    CHECK(pose.y == 0.02 && pose.theta == theta);
  }
}

// A face flat on the wall, or symmetric in the circle, bounces straight back without spin.
void check_flat_face() {
  for (const double speed : {0.2, 0.02, 0.005}) {
    const double e = speed > 0.01 ? 0.5 : 0.0;
    Pose<double> pose{0.1 - half + 1e-4, -0.03, 0};
    Motion<double> motion{speed, 0.01, 0};
    CHECK(driftwalk::meet_wall(straight(0.5, 0), half, per_inertia, pose, motion));
    CHECK_NEAR(motion.vx, -e * speed, 1e-15);
    CHECK_NEAR(motion.omega, 0.0, 1e-12);
    CHECK_NEAR(motion.vy, 0.01, 1e-15);
    CHECK_NEAR(pose.x, 0.1 - half, 1e-15);

    // In the circle the normals at the two corners are inclined by asin(h / R) to the motion, so
    // each corner's closing speed is v cos(a): the test of the threshold is on that.
    const double reach = std::sqrt(0.15 * 0.15 - half * half) - half;
    for (const double heading : {0.0, 1.0, 2.5, -2.0}) {
      const double c = std::cos(heading), s = std::sin(heading);
      Pose<double> at{(reach + 1e-4) * c, (reach + 1e-4) * s, heading};
      Motion<double> toward{speed * c, speed * s, 0};
      CHECK(driftwalk::meet_wall(circle(0.5, 0), half, per_inertia, at, toward));
      CHECK_NEAR(toward.vx, -e * speed * c, 1e-12);
      CHECK_NEAR(toward.vy, -e * speed * s, 1e-12);
      CHECK_NEAR(toward.omega, 0.0, 1e-10);
      CHECK(deepest(circle(0.5, 0), at) < 1e-15);
    }
  }
}

// A rectangle with either side flat on the wall, and a disc, bounce straight back without spin.
void check_other_bodies() {
  const auto own_axes = [](double theta) { return driftwalk::axes_at(theta); };
  const auto bounce = [&](const auto& body, const WallView<double>& wall, Pose<double>& pose,
                          Motion<double>& motion) {
    CHECK(driftwalk::meet_wall(wall, body, 600.0, driftwalk::NoArm{}, own_axes, pose, motion));
  };
  const driftwalk::Box<double> box{0.02, 0.01, std::hypot(0.02, 0.01)};
  for (int turns = 0; turns < 4; ++turns) {
    const double ahead = turns % 2 == 0 ? box.half_length : box.half_width;
    Pose<double> pose{0.1 - ahead + 1e-4, 0.03, turns * pi / 2};
    Motion<double> motion{0.05, 0.01, 0};
    bounce(box, straight(0.5, 0), pose, motion);
    CHECK_NEAR(motion.vx, -0.025, 1e-15);
    CHECK_NEAR(motion.vy, 0.01, 1e-15);
    CHECK_NEAR(motion.omega, 0.0, 1e-12);
    CHECK_NEAR(pose.x, 0.1 - ahead, 1e-15);
  }
  const driftwalk::Disc<double> disc{0.012};
  for (const double heading : {0.0, 0.7, 2.5, -2.0}) {
    const double c = std::cos(heading), s = std::sin(heading), reach = 0.15 - disc.radius + 1e-4;
    Pose<double> pose{reach * c, reach * s, 0.4};
    Motion<double> motion{0.05 * c, 0.05 * s, 0};
    bounce(disc, circle(0.5, 0), pose, motion);
    CHECK_NEAR(motion.vx, -0.025 * c, 1e-15);
    CHECK_NEAR(motion.vy, -0.025 * s, 1e-15);
    CHECK_NEAR(motion.omega, 0.0, 1e-12);
    CHECK_NEAR(std::hypot(pose.x, pose.y), 0.15 - disc.radius, 1e-15);
  }
}

// Two corners that hit at once, without bounce or friction: the pushes are the one pair for which
// each is zero or stops its corner, none pulls, and no corner goes on closing.
void check_two_corners() {
  synthetic::Uniform draw;
  int alone = 0, both = 0;
  for (int k = 0; k < 20000; ++k) {
    const double theta = 0.75 * draw(), c = std::cos(theta), s = std::sin(theta);
    Pose<double> pose{0.1 - half * (c - std::fabs(s)) + 1e-3, 0, theta}; // both corners outside
    Motion<double> motion{0.05 + 0.05 * draw(), 0.05 * draw(), 6 * draw()};
    const double arm[2] = {half * (s + c), half * (s - c)}; // y of the corners at the wall
    const double closing[2] = {motion.vx - motion.omega * arm[0],
                               motion.vx - motion.omega * arm[1]};
    if (closing[0] <= 0 || closing[1] <= 0) {
      continue;
    }
    const double own[2] = {1 + arm[0] * arm[0] * per_inertia, 1 + arm[1] * arm[1] * per_inertia};
    const double cross = 1 + arm[0] * arm[1] * per_inertia;
    const double scale = 1 / (own[0] * own[1] - cross * cross);
    double push[2] = {(own[1] * closing[0] - cross * closing[1]) * scale,
                      (own[0] * closing[1] - cross * closing[0]) * scale};
    const bool pulls = push[0] < 0 || push[1] < 0;
    for (int corner = 0; pulls && corner < 2; ++corner) {
      const double one = closing[corner] / own[corner];
      if (closing[1 - corner] - cross * one <= 0) {
        push[corner] = one;
        push[1 - corner] = 0;
      }
    }
    (pulls ? alone : both) += 1;
    const Motion<double> before = motion;
    driftwalk::meet_wall(straight(0, 0), half, per_inertia, pose, motion);
    CHECK_NEAR(motion.vx, before.vx - push[0] - push[1], 1e-13);
    CHECK_NEAR(motion.vy, before.vy, 1e-15);
    const double turn = (arm[0] * push[0] + arm[1] * push[1]) * per_inertia;
    CHECK_NEAR(motion.omega, before.omega + turn, 1e-10);
  }
  CHECK(alone > 300 && both > 300);
}

// Friction takes at most mu times the normal momentum, and never more than what stops the corner.
void check_friction() {
  for (const double friction : {0.0, 0.1, 0.5, 2.0}) {
    for (const double theta : {0.05, 0.2, 0.6, 1.2, 2.0}) {
      for (const double slide : {-0.1, -0.01, 0.0, 0.04}) {
        Pose<double> pose{0, 0, theta};
        pose.x = 0.1 - (deepest(straight(0, 0), pose) + 0.1) + 1e-4;
        Motion<double> motion{0.05, slide, 3.0};
        driftwalk::meet_wall(straight(0.5, friction), half, per_inertia, pose, motion);
        const double normal_impulse = 0.05 - motion.vx;
        CHECK(std::fabs(slide - motion.vy) <= friction * normal_impulse + 1e-15);
      }
    }
    // A corner straight ahead: normal and tangent do not mix, so the impulse is known.
    const double arm = half * std::sqrt(2.0), speed = 0.05, slide = 0.04;
    Pose<double> pose{0.1 - arm + 1e-4, 0, pi / 4};
    Motion<double> motion{speed, slide, 0};
    driftwalk::meet_wall(straight(0.5, friction), half, per_inertia, pose, motion);
    const double rub = std::min(friction * 1.5 * speed, slide / (1 + arm * arm * per_inertia));
    CHECK_NEAR(motion.vx, -0.5 * speed, 1e-15);
    CHECK_NEAR(motion.vy, slide - rub, 1e-15);
    CHECK_NEAR(motion.omega, -rub * arm * per_inertia, 1e-12);
  }
}

struct Corner {
  double x, y;
};

std::vector<PreparedEdge<double>> polygon(std::initializer_list<Corner> corners) {
  std::vector<PreparedEdge<double>> edges;
  const std::vector<Corner> list(corners);
  for (std::size_t k = 0; k < list.size(); ++k) {
    const Corner a = list[k], b = list[(k + 1) % list.size()];
    const double length = std::hypot(b.x - a.x, b.y - a.y);
    const double nx = (b.y - a.y) / length, ny = (a.x - b.x) / length;
    edges.push_back({nx, ny, nx * a.x + ny * a.y});
  }
  return edges;
}

// Poses just across the wall, any motion: energy never grows and every corner ends inside.
void check_random_impacts(const WallView<double>& shape, const char* name, double start_depth,
                          double left_outside) {
  synthetic::Uniform draw;
  double gained = -1, outside = -1, single_gained = -1;
  int hits = 0;
  for (int k = 0; k < 60000; ++k) {
    WallView<double> wall = shape;
    wall.restitution = (draw() + 1) / 2;
    wall.friction = draw() + 1;
    Pose<double> pose{0.15 * draw(), 0.15 * draw(), pi * draw()};
    if (std::hypot(pose.x, pose.y) > 0.15 || deepest(wall, pose) > start_depth) {
      continue;
    }
    Motion<double> motion{0.2 * draw(), 0.2 * draw(), 15 * draw()};
    const double before = energy(motion);
    Pose<Pack> packed_pose{Pack(float(pose.x)), Pack(float(pose.y)), Pack(float(pose.theta))};
    Motion<Pack> packed{Pack(float(motion.vx)), Pack(float(motion.vy)), Pack(float(motion.omega))};
    const bool touched = driftwalk::meet_wall(wall, half, per_inertia, pose, motion);
    hits += touched ? 1 : 0;
    gained = std::max(gained, energy(motion) / before - 1);
    outside = std::max(outside, deepest(wall, pose));
    if (wall.edge_count == 0) {
      const WallView<float> narrow{
          float(wall.radius),      nullptr, 0, float(wall.restitution), float(wall.friction),
          float(wall.bounce_speed)};
      driftwalk::meet_wall(narrow, float(half), Pack(float(per_inertia)), packed_pose, packed);
      single_gained = std::max(single_gained,
                               energy({packed.vx[1], packed.vy[1], packed.omega[1]}) / before - 1);
    }
  }
  std::printf("%s: %d hits, energy gained %.2g (float %.2g), outside %.2g m\n", name, hits, gained,
              single_gained, outside);
  CHECK(hits > 500);
  CHECK(gained < 1e-12);
  CHECK(single_gained < 1e-5);
  CHECK(outside < left_outside);
}

} // namespace

int main() {
  check_single_corner();
  check_flat_face();
  check_other_bodies();
  check_two_corners();
  check_friction();
  check_random_impacts(circle(0, 0), "circle", 0.01, 1e-15);
  const auto view = [](const std::vector<PreparedEdge<double>>& edges) {
    return WallView<double>{0, edges.data(), int(edges.size()), 0, 0, 0.01};
  };
  const auto square = polygon({{-0.1, -0.1}, {0.1, -0.1}, {0.1, 0.1}, {-0.1, 0.1}});
  const auto triangle = polygon({{-0.12, -0.08}, {0.12, -0.08}, {0.0, 0.14}});
  const auto hexagon = polygon(
      {{0.12, 0}, {0.06, 0.104}, {-0.06, 0.104}, {-0.12, 0}, {-0.06, -0.104}, {0.06, -0.104}});
  const auto acute = polygon({{-0.15, -0.05}, {0.15, -0.05}, {-0.15, 0.05}});
  check_random_impacts(view(square), "square", 0.01, 1e-15);
  check_random_impacts(view(hexagon), "hexagon", 0.01, 1e-15);
  check_random_impacts(view(triangle), "triangle", 0.01, 1e-10);
  // In a corner of 18 degrees each round removes a tenth; 2 mm is one step at 0.2 m/s.
  check_random_impacts(view(acute), "acute triangle", 0.002, 0.001);
  return check::result();
}
