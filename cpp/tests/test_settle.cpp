// Merges and collisions of scenes put together by hand: conservation laws summed block by block,
// overlaps measured from corners, impulses from a textbook.
#include "check.hpp"
#include "hand_scene.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

namespace {

using driftwalk::Latching;
using squares::pi;
using synthetic::Cells;
using synthetic::HandScene;
using synthetic::Momentum;
using synthetic::Place;
using synthetic::Uniform;

constexpr double side = 0.03, mass = 0.0116;

const Cells shapes[] = {
    {{0, 0}}, {{0, 0}, {1, 0}}, {{0, 0}, {1, 0}, {2, 0}}, {{0, 0}, {1, 0}, {0, 1}}};

std::vector<int> range(int first, int count) {
  std::vector<int> numbers;
  for (int k = 0; k < count; ++k) {
    numbers.push_back(first + k);
  }
  return numbers;
}

// Two assemblies in motion that overlap by less than 2 mm; the block numbers of the first follow
// those of the second when `swapped`.
void random_meeting(HandScene& hand, Uniform& draw, const Cells& a, const Cells& b, bool swapped) {
  const int count_a = int(a.size()), count_b = int(b.size());
  const auto blocks_a = range(swapped ? count_b : 0, count_a);
  const auto blocks_b = range(swapped ? 0 : count_a, count_b);
  hand.add(blocks_a, a, 0.3 * draw(), 0.3 * draw(), pi * draw(), 0.1 * draw(), 0.1 * draw(),
           3 * draw());
  const double heading = pi * draw(), turned = pi * draw();
  const double vx = 0.1 * draw(), vy = 0.1 * draw(), omega = 3 * draw();
  const double wanted = 5e-4 + 4e-4 * draw(); // depth of the overlap
  double near = 0, far = 0.3;
  const driftwalk::SceneAssembly& other = hand.of(blocks_a[0]);
  for (int k = 0; k < 40; ++k) {
    const double distance = (near + far) / 2;
    hand.scene.assemblies = 1;
    hand.add(blocks_b, b, other.x + distance * std::cos(heading),
             other.y + distance * std::sin(heading), turned, vx, vy, omega);
    (hand.deepest() > wanted ? near : far) = distance;
  }
}

bool is_whole(double number) {
  return std::fabs(number - std::round(number)) < 1e-10;
}

// Lattice, faces and events of one assembly, from the poses of its blocks alone.
void check_lattice(const HandScene& hand, const std::vector<int>& blocks) {
  const squares::Square origin = hand.square(blocks[0]);
  const double c = std::cos(origin.theta), s = std::sin(origin.theta);
  std::set<std::pair<long, long>> cells;
  for (const int b : blocks) {
    const double dx = hand.square(b).x - origin.x, dy = hand.square(b).y - origin.y;
    const double along = (c * dx + s * dy) / side, across = (c * dy - s * dx) / side;
    CHECK(is_whole(along) && is_whole(across));
    cells.insert({std::lround(along), std::lround(across)});
    unsigned joined = 0;
    for (const int other : blocks) {
      for (int face = 0; face < 4; ++face) {
        const double angle = origin.theta + face * pi / 2;
        const double x = hand.square(b).x + side * std::cos(angle) - hand.square(other).x;
        const double y = hand.square(b).y + side * std::sin(angle) - hand.square(other).y;
        joined |= std::hypot(x, y) < 1e-9 ? 1u << face : 0u;
      }
    }
    CHECK(hand.block[std::size_t(b)].joined == joined);
  }
  CHECK(cells.size() == blocks.size());
}

// Where a face of a block is, by the block's own frame.
void own_face(const HandScene& hand, int block, int face, double& x, double& y, double& angle) {
  angle = hand.square(block).theta + (hand.block[std::size_t(block)].quarter + face) * pi / 2;
  x = hand.square(block).x + side / 2 * std::cos(angle);
  y = hand.square(block).y + side / 2 * std::sin(angle);
}

void check_merges() {
  Uniform draw;
  int merged = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const Cells &a = shapes[trial % 4], &b = shapes[trial / 4 % 4];
    const bool swapped = trial / 16 % 2 == 1;
    const int count = int(a.size() + b.size());
    Place place(Place::wide(), count);
    place.rules.latching = Latching::collision;
    HandScene hand(place.rules);
    random_meeting(hand, draw, a, b, swapped);
    const std::vector<int> all = range(0, count);
    const Momentum before = synthetic::momentum(hand, all);
    std::vector<squares::Square> poses;
    std::vector<int> roots;
    for (const int k : all) {
      poses.push_back(hand.square(k));
      roots.push_back(hand.block[std::size_t(k)].assembly);
    }
    const int size_low = swapped ? int(b.size()) : int(a.size());
    hand.settle();
    CHECK(hand.scene.contact);
    CHECK(hand.scene.event_count == (hand.scene.assemblies == 1 ? 1 : 0));
    if (hand.scene.assemblies != 1) {
      continue; // the lattice has no room for these faces
    }
    ++merged;
    const Momentum after = synthetic::momentum(hand, all);
    CHECK_NEAR(after.x, before.x, 1e-16);
    CHECK_NEAR(after.y, before.y, 1e-16);
    CHECK_NEAR(after.spin, before.spin, 1e-17);
    CHECK(hand.of(0).touched);
    check_lattice(hand, all);
    // The larger stays where it was; of equal ones the one with the lowest block.
    const bool low_stays = size_low >= count - size_low;
    const int stayed = hand.event_block[0], moved = hand.event_block[1];
    CHECK((roots[std::size_t(stayed)] == 0) == low_stays);
    CHECK((roots[std::size_t(moved)] == 0) != low_stays);
    for (const int k : all) {
      const squares::Square was = poses[std::size_t(k)], is = hand.square(k);
      if (roots[std::size_t(k)] == roots[std::size_t(stayed)]) {
        CHECK(std::hypot(is.x - was.x, is.y - was.y) < 1e-14 && is.theta == was.theta);
      }
    }
    double x, y, angle, peer_x, peer_y, peer_angle;
    own_face(hand, stayed, hand.event_face[0], x, y, angle);
    own_face(hand, moved, hand.event_face[1], peer_x, peer_y, peer_angle);
    CHECK(std::hypot(x - peer_x, y - peer_y) < 1e-14);
    CHECK(std::fabs(std::cos(angle - peer_angle) + 1) < 1e-12);
    CHECK(hand.event_step[0] == 7);
  }
  std::printf("merges: %d of 2000\n", merged);
  CHECK(merged > 1800);
}

// Two pairs side by side close a square: one merge joins four faces more than its two.
void check_one_merge_joins_all_neighbours() {
  Place place(Place::wide(), 4);
  place.rules.latching = Latching::collision;
  HandScene hand(place.rules);
  hand.add({0, 2}, shapes[1], 0, 0, 0.2);
  hand.add({1, 3}, shapes[1], -0.0285 * std::sin(0.22), 0.0285 * std::cos(0.22), 0.25);
  hand.settle();
  CHECK(hand.scene.assemblies == 1 && hand.scene.event_count == 1);
  check_lattice(hand, {0, 1, 2, 3});
  for (const driftwalk::SceneBlock& block : hand.block) {
    CHECK(__builtin_popcount(block.joined) == 2);
  }
  CHECK_NEAR(hand.of(0).inertia, 4 * (mass * side * side / 6 + mass * side * side / 2), 1e-18);
}

// A pair in the notch of a corner whose nearest faces have no room on the lattice takes others.
void check_occupied_cells() {
  Uniform draw;
  int others_taken = 0;
  for (int trial = 0; trial < 500; ++trial) {
    Place place(Place::wide(), 5);
    place.rules.latching = Latching::collision;
    HandScene hand(place.rules);
    hand.add({0, 1, 2}, shapes[3], 0, 0, 0);
    const squares::Square right = hand.square(1);
    hand.add({3, 4}, shapes[1], right.x + 0.4 * side * (1 + draw()),
             right.y + side + 0.3 * side * draw(), pi * draw());
    double nearest = 1;
    int face_block = -1, peer = -1;
    for (int a = 0; a < 3; ++a) {
      for (int b = 3; b < 5; ++b) {
        for (int f = 0; f < 16; ++f) {
          const int face = f / 4, other = f % 4;
          if ((hand.block[std::size_t(a)].joined >> face & 1u) != 0 ||
              (hand.block[std::size_t(b)].joined >> other & 1u) != 0 ||
              squares::overlap(hand.square(a), hand.square(b)) <= 0) {
            continue;
          }
          double x, y, angle, px, py, peer_angle;
          own_face(hand, a, face, x, y, angle);
          own_face(hand, b, other, px, py, peer_angle);
          const double dx = hand.square(b).x - hand.square(a).x;
          const double dy = hand.square(b).y - hand.square(a).y;
          if (dx * std::cos(angle) + dy * std::sin(angle) > 0 &&
              dx * std::cos(peer_angle) + dy * std::sin(peer_angle) < 0 &&
              std::cos(angle - peer_angle) < 0 && std::hypot(px - x, py - y) < nearest) {
            nearest = std::hypot(px - x, py - y);
            face_block = a;
            peer = b;
          }
        }
      }
    }
    hand.settle();
    if (hand.scene.assemblies == 1) {
      check_lattice(hand, {0, 1, 2, 3, 4});
      others_taken += hand.event_block[0] != face_block || hand.event_block[1] != peer ? 1 : 0;
    } else {
      CHECK(hand.scene.event_count == 0);
      CHECK(hand.block[4].assembly == 3 && hand.block[2].assembly == 0);
    }
  }
  std::printf("occupied cells: other faces taken %d times\n", others_taken);
  CHECK(others_taken > 5);
}

// Where the aligned pair would cross the wall it is shifted inward, and no farther.
void check_wall_shift() {
  synthetic::Tank small;
  small.model.radius = 0.1;
  Place place(small, 2);
  place.rules.latching = Latching::collision;
  HandScene hand(place.rules);
  hand.add({0}, shapes[0], 0.055, 0, 0);
  hand.add({1}, shapes[0], 0.078, 0.004, 0.35);
  hand.settle();
  CHECK(hand.scene.assemblies == 1);
  check_lattice(hand, {0, 1});
  double outside = -1;
  for (const int b : {0, 1}) {
    outside = std::max(outside, squares::outside(place.tank, hand.square(b)));
  }
  CHECK(outside < 1e-6);
  // In line with the first the second would have stood more than a millimetre through the wall.
  CHECK(outside > -1e-4);
  CHECK(hand.square(0).x < 0.0545);

  // Between two walls closer than a pair is long, the nearest faces cannot join; the next ones do.
  for (const bool is_narrow : {false, true}) {
    synthetic::Tank channel;
    const double across = is_narrow ? 0.028 : 0.1;
    channel.model.radius = 0;
    channel.edges = {0, -1, 0.5, 1, 0, across, 0, 1, 0.5, -1, 0, across};
    Place narrow(channel, 2);
    narrow.rules.latching = Latching::collision;
    HandScene pair(narrow.rules);
    pair.add({0}, shapes[0], -0.012, 0, 0);
    pair.add({1}, shapes[0], 0.0127, 0.024, 0);
    pair.settle();
    CHECK(pair.scene.assemblies == 1);
    CHECK(pair.event_face[0] == (is_narrow ? 1 : 0) && pair.event_face[1] == (is_narrow ? 3 : 2));
    CHECK(squares::outside(channel, pair.square(1)) < 1e-6);
  }
}

// The nearest faces would put the moved block 0.5 mm into a third: they do not join, others do.
void check_third_assembly() {
  for (const double depth : {5e-4, 0.9e-4}) {
    Place place(Place::wide(), 3);
    place.rules.latching = Latching::collision;
    HandScene hand(place.rules);
    hand.add({0}, shapes[0], 0, 0, 0);
    hand.add({1}, shapes[0], side - 1e-3, 0.6 * side, 0.2);
    hand.add({2}, shapes[0], -0.01, 2 * side - depth, 0);
    hand.settle();
    CHECK(hand.scene.event_count >= 1);
    CHECK(hand.event_face[0] == (depth > 1e-4 ? 0 : 1));
    CHECK(hand.deepest() < 1.01e-4);
  }
}

// What a jam would take back must not come to lie in what has merged meanwhile.
void check_merge_is_clear_of_earlier_poses() {
  Place place(Place::wide(), 3);
  place.rules.latching = Latching::collision;
  HandScene hand(place.rules);
  hand.add({0}, shapes[0], 0, 0, 0);
  hand.add({1}, shapes[0], side - 1e-3, 0.6 * side, 0.2);
  hand.add({2}, shapes[0], -0.01, 2 * side + 1e-3, 0);
  hand.assembly[2].before.y = 2 * side - 5e-4;
  hand.settle();
  CHECK(hand.event_face[0] == 0);
}

// Faces that are a little nearer, or turned a little less, than the tolerances latch; others not.
void check_connectors() {
  for (const double axis : {0.05, 0.2, 0.6}) {
    for (const double distance : {0.001, 0.01, 0.02}) {
      for (const double direction : {0.0, 0.8, 1.4, -1.2}) {
        for (const double share : {0.999, 1.001}) {
          for (const bool axis_decides : {false, true}) {
            const double turned = axis * (axis_decides ? share : 0.9);
            const double gap = distance * (axis_decides ? 0.9 : share);
            Place place(Place::wide(), 2);
            place.rules.connector_distance = distance;
            place.rules.connector_cosine = std::cos(axis);
            HandScene hand(place.rules);
            hand.add({0}, shapes[0], 0, 0, 0);
            hand.add({1}, shapes[0],
                     side / 2 + gap * std::cos(direction) + side / 2 * std::cos(turned),
                     gap * std::sin(direction) + side / 2 * std::sin(turned), turned);
            const bool overlap = hand.deepest() > 0;
            hand.settle();
            CHECK((hand.scene.assemblies == 1) == (share < 1));
            CHECK(hand.scene.contact == (share < 1 || overlap));
          }
        }
      }
    }
  }
}

// --- collisions ---

// Face on, in line with both centres: both speeds from e and the masses.
void check_head_on() {
  for (const double e : {0.0, 0.4, 1.0}) {
    for (const double speed : {0.1, 0.0101, 0.0099}) {
      for (const std::size_t shape : {0u, 1u, 2u}) {
        const int count = int(shapes[shape].size());
        Place place(Place::wide(), count + 1);
        place.rules.latching = Latching::none;
        place.rules.restitution = e;
        place.rules.friction = 0.7;
        HandScene hand(place.rules);
        const double turned = 0.4, c = std::cos(turned), s = std::sin(turned);
        const double reach = (count + 1) * side / 2 - 1e-4;
        hand.add(range(0, count), shapes[shape], 0, 0, turned, speed / 4 * c, speed / 4 * s);
        hand.add({count}, shapes[0], reach * c, reach * s, turned, -0.75 * speed * c,
                 -0.75 * speed * s);
        hand.settle();
        const double bounced = speed > 0.01 ? e : 0.0;
        const double push = (1 + bounced) * speed * count / (count + 1.0); // per mass of a block
        const double first = speed / 4 - push / count, second = push - 0.75 * speed;
        CHECK_NEAR(hand.of(0).vx, first * c, 1e-15);
        CHECK_NEAR(hand.of(0).vy, first * s, 1e-15);
        CHECK_NEAR(hand.of(count).vx, second * c, 1e-15);
        CHECK_NEAR(hand.of(count).vy, second * s, 1e-15);
        CHECK_NEAR(hand.of(0).omega, 0.0, 1e-12);
        CHECK_NEAR(hand.of(count).omega, 0.0, 1e-12);
        CHECK(hand.scene.assemblies == 2 && hand.scene.event_count == 0 && hand.scene.contact);
        CHECK(hand.deepest() < 1e-12);
      }
    }
  }
}

// A corner against a face: the textbook impulse with a lever on one side only.
void check_corner_impact() {
  Place place(Place::wide(), 2);
  place.rules.latching = Latching::none;
  place.rules.restitution = 0.6;
  const double inertia = mass * side * side / 6, half_diagonal = side * std::sqrt(0.5);
  const double reach = side / 2 + half_diagonal - 1e-9, closing = 0.08, slide = 0.05;
  for (const double lever : {0.01, -0.004}) {
    HandScene hand(place.rules);
    hand.add({0}, shapes[0], 0, 0, 0);
    hand.add({1}, shapes[0], reach, lever, pi / 4, -closing, slide);
    hand.settle();
    const double push = 1.6 * closing / (2 / mass + lever * lever / inertia);
    CHECK_NEAR(hand.of(0).vx, -push / mass, 1e-15);
    CHECK_NEAR(hand.of(0).omega, push * lever / inertia, 1e-12);
    CHECK_NEAR(hand.of(1).vx, push / mass - closing, 1e-15);
    CHECK(hand.of(1).omega < 1e-12 && hand.of(1).vy == slide);
  }
  // In the middle of the face normal and tangent do not mix: friction stops the sliding, or takes
  // its share of the normal impulse.
  for (const double friction : {0.05, 0.1, 5.0}) {
    place.rules.friction = friction;
    HandScene hand(place.rules);
    hand.add({0}, shapes[0], 0, 0, 0);
    hand.add({1}, shapes[0], reach, 0, pi / 4, -closing, slide);
    hand.settle();
    const double levers = side * side / 4 + half_diagonal * half_diagonal;
    const double rub =
        std::min(friction * 0.8 * closing * mass, slide / (2 / mass + levers / inertia));
    CHECK_NEAR(mass * hand.of(0).vy, rub, 1e-10);
    CHECK_NEAR(mass * (slide - hand.of(1).vy), rub, 1e-10);
    CHECK_NEAR(hand.of(0).omega, rub * side / 2 / inertia, 1e-5);
    CHECK_NEAR(hand.of(1).omega, rub * half_diagonal / inertia, 1e-5);
  }
}

// Whether an impulse from the first square on the second lies in the friction cone about a normal
// to one of their sides.
bool is_in_cone(const squares::Square& a, const squares::Square& b, double jx, double jy,
                double friction) {
  for (int k = 0; k < 8; ++k) {
    const double angle = (k < 4 ? a.theta : b.theta) + k * pi / 2;
    const double c = std::cos(angle), s = std::sin(angle);
    if ((b.x - a.x) * c + (b.y - a.y) * s > 0 &&
        std::fabs(jy * c - jx * s) <= friction * (jx * c + jy * s) + 1e-15) {
      return true;
    }
  }
  return false;
}

void check_coulomb() {
  Uniform draw;
  for (int trial = 0; trial < 1000; ++trial) {
    Place place(Place::wide(), 2);
    place.rules.latching = Latching::none;
    place.rules.friction = (draw() + 1) / 4;
    HandScene hand(place.rules);
    random_meeting(hand, draw, shapes[0], shapes[0], false);
    const squares::Square a = hand.square(0), b = hand.square(1);
    const double vx = hand.of(1).vx, vy = hand.of(1).vy;
    hand.settle();
    CHECK(is_in_cone(a, b, mass * (hand.of(1).vx - vx), mass * (hand.of(1).vy - vy),
                     place.rules.friction));
  }
}

// Any two assemblies, any rule: momentum stays, energy never grows, nothing overlaps afterwards.
void check_random_collisions() {
  Uniform draw;
  double gained = -1, drifted = 0, deepest = -1, lost = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    const Cells &a = shapes[trial % 4], &b = shapes[trial / 4 % 4];
    const int count = int(a.size() + b.size());
    Place place(Place::wide(), count);
    place.rules.latching = Latching::none;
    place.rules.restitution = (draw() + 1) / 2;
    place.rules.friction = draw() + 1;
    HandScene hand(place.rules);
    random_meeting(hand, draw, a, b, false);
    const std::vector<int> all = range(0, count);
    const Momentum before = synthetic::momentum(hand, all);
    hand.settle();
    const Momentum after = synthetic::momentum(hand, all);
    gained = std::max(gained, after.energy / before.energy - 1);
    lost = std::max(lost, 1 - after.energy / before.energy);
    deepest = std::max(deepest, hand.deepest());
    drifted =
        std::max({drifted, std::fabs(after.x - before.x), std::fabs(after.y - before.y),
                  std::hypot(after.middle_x - before.middle_x, after.middle_y - before.middle_y)});
  }
  std::printf(
      "collisions: energy gained %.2g, lost at most %.2g, momentum drift %.2g, left %.2g m\n",
      gained, lost, drifted, deepest);
  CHECK(gained < 1e-12);
  CHECK(lost > 0.5);
  CHECK(drifted < 1e-15);
  CHECK(deepest < 1.01e-5);
}

// Angular momentum about the joint centre of mass, without the shift of positions.
void check_spin_is_kept() {
  Uniform draw;
  for (int trial = 0; trial < 1000; ++trial) {
    const Cells &a = shapes[trial % 4], &b = shapes[trial / 4 % 4];
    const int count = int(a.size() + b.size());
    Place place(Place::wide(), count);
    place.rules.latching = Latching::none;
    place.rules.friction = draw() + 1;
    HandScene hand(place.rules);
    random_meeting(hand, draw, a, b, false);
    const std::vector<int> all = range(0, count);
    const Momentum before = synthetic::momentum(hand, all);
    driftwalk::find_pairs(place.rules, hand.scene);
    driftwalk::bounce(place.rules, hand.scene);
    CHECK_NEAR(synthetic::momentum(hand, all).spin, before.spin, 1e-17);
  }
}

// A heap of blocks pressed into each other and into the wall: parted, inside, the same once more.
void check_heaps() {
  Uniform draw;
  double deepest = -1, outside = -1;
  for (int trial = 0; trial < 60; ++trial) {
    synthetic::Tank tank;
    tank.model.radius = 0.12;
    Place place(tank, 12);
    place.rules.latching = Latching::none;
    HandScene hand(place.rules);
    std::vector<double> start(36);
    CHECK(driftwalk::place_blocks(place.rules, std::uint64_t(trial), start.data()) == 12);
    for (int b = 0; b < 12; ++b) {
      const double* const p = &start[3 * std::size_t(b)];
      hand.add({b}, shapes[0], p[0], p[1], p[2]);
      // All rush to one side, up to 3 mm in this step.
      driftwalk::SceneAssembly& a = hand.assembly[std::size_t(b)];
      a.x += 0.003;
      a.y += 0.001 * draw();
      driftwalk::place_members(hand.scene, b);
      driftwalk::push_inside(place.rules, hand.scene, b, 64);
    }
    hand.settle();
    deepest = std::max(deepest, hand.deepest());
    for (int b = 0; b < 12; ++b) {
      outside = std::max(outside, squares::outside(tank, hand.square(b)));
    }
  }
  std::printf("heaps: left %.2g m, outside %.2g m\n", deepest, outside);
  CHECK(deepest < 1.01e-4);
  CHECK(outside < 1.01e-4);
}

// What cannot be parted, or cannot be put inside, is back where it was, at rest.
void check_taken_back() {
  // Two blocks side by side in a channel a millimetre too narrow for both.
  synthetic::Tank channel;
  channel.model.radius = 0;
  channel.edges = {0, -1, 0.5, 1, 0, 0.0295, 0, 1, 0.5, -1, 0, 0.0295};
  Place narrow(channel, 2);
  narrow.rules.latching = Latching::none;
  HandScene pair(narrow.rules);
  pair.add({0}, shapes[0], -0.0145, 0, 0, 0, 0.1);
  pair.add({1}, shapes[0], 0.0145, 0.002, 0, 0, -0.1);
  pair.assembly[1].before.y = 0.0301;
  pair.settle();
  CHECK(pair.square(0).y == 0 && pair.square(1).y == 0.0301);
  CHECK(pair.of(0).vy == 0 && pair.of(1).vy == 0 && pair.of(1).touched);

  // Five blocks in line across a channel, turned into both its walls, against a sixth.
  synthetic::Tank wide;
  wide.model.radius = 0;
  wide.edges = {0, -1, 0.5, 1, 0, 0.0752, 0, 1, 0.5, -1, 0, 0.0752};
  Place place(wide, 6);
  place.rules.latching = Latching::none;
  HandScene line(place.rules);
  line.add(range(0, 5), {{0, 0}, {1, 0}, {2, 0}, {3, 0}, {4, 0}}, 0, 0, 0.15, 0, 0.02, 1);
  line.add({5}, shapes[0], 0, 0.0298, 0.15);
  line.assembly[0].before = {0, 0, 0, 1, 0};
  line.assembly[5].before = {0, 0.0301, 0, 1, 0};
  line.settle();
  CHECK(line.of(0).theta == 0 && line.of(0).omega == 0 && line.of(0).vy == 0);
  CHECK(line.deepest() < 1e-4);
  for (int b = 0; b < 6; ++b) {
    CHECK(squares::outside(wide, line.square(b)) < 1e-4);
  }
}

// A block askew between another and the wall of a narrow channel has to turn, past half a turn.
void check_turned_apart() {
  const double tilt = 0.05, c = std::cos(tilt), s = std::sin(tilt);
  synthetic::Tank channel;
  channel.model.radius = 0;
  channel.edges = {s, -c, 0.5, c, s, 0.0306, -s, c, 0.5, -c, -s, 0.0306};
  Place place(channel, 2);
  place.rules.latching = Latching::none;
  HandScene hand(place.rules);
  hand.add({0}, shapes[0], -0.0156 * c, -0.0156 * s, tilt);
  hand.add({1}, shapes[0], 0.0147 * c, 0.0147 * s, pi - 0.01);
  hand.settle();
  CHECK(hand.deepest() < 1e-4);
  CHECK(squares::outside(channel, hand.square(0)) < 1e-4);
  CHECK(squares::outside(channel, hand.square(1)) < 1e-4);
  CHECK(hand.of(1).theta < 0 && hand.of(1).theta > -pi);
  CHECK_NEAR(std::cos(hand.of(1).theta), hand.of(1).cosine, 1e-8);
  CHECK_NEAR(std::sin(hand.of(1).theta), hand.of(1).sine, 1e-8);
}

// --- the search for near pairs ---

// In order, and all that are nearer than a diagonal and the skin: with few blocks and with many,
// also of blocks outside the tank and at no place at all.
void check_pair_search() {
  Uniform draw;
  for (const int blocks : {5, driftwalk::most_blocks_all_pairs + 1, 90}) {
    for (const double spread : {0.1, 0.5, 9.0}) {
      Place place(Place::wide(), blocks);
      place.rules.low_x = place.rules.low_y = -0.4 * spread;
      place.rules.high_x = place.rules.high_y = 0.7 * spread;
      HandScene hand(place.rules);
      for (int b = 0; b < blocks; ++b) {
        hand.add({b}, shapes[0], spread * draw(), spread * draw(), 0);
      }
      hand.block[1].x = NAN;
      driftwalk::find_pairs(place.rules, hand.scene);
      int k = 0;
      const double reach = side * (std::sqrt(2.0) + driftwalk::pair_skin_sides);
      for (int a = 0; a < blocks; ++a) {
        for (int b = a + 1; b < blocks; ++b) {
          if (std::hypot(hand.square(a).x - hand.square(b).x, hand.square(a).y - hand.square(b).y) <
              reach) {
            const driftwalk::BlockPair found = hand.pairs[std::size_t(k++)];
            CHECK(found.first == a && found.second == b);
          }
        }
      }
      CHECK(hand.scene.pairs.count == k);
      CHECK(k > 0 || spread > 0.1);
    }
  }
}

} // namespace

int main() {
  check_merges();
  check_one_merge_joins_all_neighbours();
  check_occupied_cells();
  check_wall_shift();
  check_third_assembly();
  check_merge_is_clear_of_earlier_poses();
  check_connectors();
  check_head_on();
  check_corner_impact();
  check_coulomb();
  check_random_collisions();
  check_spin_is_kept();
  check_heaps();
  check_taken_back();
  check_turned_apart();
  check_pair_search();
  return check::result();
}
