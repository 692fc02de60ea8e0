// Whole runs of worlds with several blocks: the same bits however they are run, one block as in the
// one-block kernel, no overlap and no corner outside in jams, events that fit the final cells, the
// energy of hard bodies.
#include "check.hpp"
#include "driftwalk/assembly/lane.hpp"
#include "driftwalk/assembly/walls.hpp"
#include "driftwalk/dispatch.hpp"
#include "driftwalk/physics/laws/quadratic.hpp"
#include "environment.hpp"
#include "synthetic_assembly.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using driftwalk::AssemblyRules;
using driftwalk::Latching;
using squares::pi;
using squares::Square;
using synthetic::Crowd;
using synthetic::CrowdResults;
using synthetic::Tank;

constexpr double side = 0.03;

void swirl(double x, double y, double& u, double& v) {
  const double q = std::hypot(x, y) / 0.15;
  const double speed = 0.05 * q * (1.5 - q);
  u = -speed * y / 0.15 + 0.01 * std::sin(40 * y);
  v = speed * x / 0.15 + 0.01 * std::cos(40 * x);
}

Tank rectangle() {
  Tank tank;
  tank.model.radius = 0;
  tank.edges = {0, -1, 0.09, 1, 0, 0.13, 0, 1, 0.09, -1, 0, 0.13};
  return tank;
}
Tank triangle() {
  Tank tank;
  tank.model.radius = 0;
  const double s = std::sqrt(0.75);
  tank.edges = {0, -1, 0.09, s, 0.5, 0.09, -s, 0.5, 0.09};
  return tank;
}

Crowd crowd_in(const AssemblyRules& rules, int worlds) {
  Crowd crowd(rules.blocks);
  const double drag[] = {0.45, 0, 4, 1, 0.05}, force[] = {0.55e-3, 4e-3, 0, 2e-3};
  for (std::uint64_t k = 0; int(crowd.worlds()) < worlds && k < 1000; ++k) {
    crowd.add_random(rules, k, drag[crowd.worlds() % 5], force[crowd.worlds() % 4]);
  }
  CHECK(int(crowd.worlds()) == worlds);
  return crowd;
}

template <class T>
bool same_row(const std::vector<T>& a, std::size_t row_a, const std::vector<T>& b,
              std::size_t row_b, std::size_t width) {
  return width == 0 || std::memcmp(&a[row_a * width], &b[row_b * width], width * sizeof(T)) == 0;
}

// What is the same however a world is run.
bool same_world(const CrowdResults& a, std::size_t i, const CrowdResults& b, std::size_t j) {
  const std::size_t k = a.blocks, e = a.events;
  return same_row(a.status, i, b.status, j, 1) && same_row(a.event_count, i, b.event_count, j, 1) &&
         same_row(a.event_step, i, b.event_step, j, e) &&
         same_row(a.event_block, i, b.event_block, j, 2 * e) &&
         same_row(a.event_face, i, b.event_face, j, 2 * e) &&
         same_row(a.first_contact, i, b.first_contact, j, 1) &&
         same_row(a.end_step, i, b.end_step, j, 1) && same_row(a.pose, i, b.pose, j, 3 * k) &&
         same_row(a.cell, i, b.cell, j, 2 * k) && same_row(a.quarter, i, b.quarter, j, k) &&
         same_row(a.assembly, i, b.assembly, j, k);
}

// Worlds alone, in any company, on any processor, by any number of threads.
void check_same_bits(Tank tank, int blocks, int worlds, std::int64_t steps) {
  tank.model.radius = 0.03 * std::sqrt(blocks + 2.0); // crowded: many worlds end early
  tank.set_flow(swirl);
  tank.model.friction = 0.3;
  const driftwalk::PreparedRun<double> prepared(tank.finished());
  const AssemblyRules rules = synthetic::rules_in(prepared, blocks);
  const Crowd crowd = crowd_in(rules, worlds);
  const CrowdResults all = synthetic::assemble<float>(tank, rules, crowd, steps);
  const auto most = std::max_element(all.event_count.begin(), all.event_count.end());
  CHECK(blocks == 1 || *most > 0);
  std::int64_t block_steps = 0;
  for (const std::int32_t end : all.end_step) {
    block_steps += std::int64_t(end) * blocks;
  }
  CHECK(all.block_steps == block_steps);
  Crowd reversed(blocks);
  for (std::size_t k = crowd.worlds(); k-- > 0;) {
    const Crowd one = crowd.alone(k);
    reversed.add(one.start, one.key[0], one.drag_coefficient[0], one.force_std[0]);
  }
  const CrowdResults backwards = synthetic::assemble<float>(tank, rules, reversed, steps, 0, 3);
  for (std::size_t k = 0; k < crowd.worlds(); ++k) {
    CHECK(same_world(all, k, backwards, crowd.worlds() - 1 - k));
  }
  for (std::size_t k = 0; k < crowd.worlds(); k += 5) {
    const CrowdResults one = synthetic::assemble<float>(tank, rules, crowd.alone(k), steps);
    CHECK(same_world(all, k, one, 0));
  }
  const std::string own = driftwalk::name(driftwalk::chosen_instruction_set());
  for (const char* const set : {"baseline", "avx2", "avx512"}) {
    if (set == own) {
      continue; // that of all runs above
    }
    environment::choose_instruction_set(set);
    try {
      const CrowdResults other = synthetic::assemble<float>(tank, rules, crowd, steps);
      for (std::size_t k = 0; k < crowd.worlds(); ++k) {
        CHECK(same_world(all, k, other, k));
      }
      std::printf("%d blocks: the same bits on %s\n", blocks, set);
    } catch (const std::invalid_argument&) {
      std::printf("%s is not on this machine\n", set);
    }
  }
  environment::choose_instruction_set("");
}

// Samples change nothing but that a complete world goes on.
void check_sampling(int blocks) {
  Tank tank;
  tank.model.radius = 0.03 * std::sqrt(blocks + 2.0);
  tank.set_flow(swirl);
  const driftwalk::PreparedRun<double> prepared(tank.finished());
  const AssemblyRules rules = synthetic::rules_in(prepared, blocks);
  const Crowd crowd = crowd_in(rules, 30);
  const std::int64_t steps = 1501;
  const CrowdResults plain = synthetic::assemble<float>(tank, rules, crowd, steps);
  const CrowdResults sampled = synthetic::assemble<float>(tank, rules, crowd, steps, 50);
  const std::size_t k = sampled.blocks, e = sampled.events;
  CHECK(sampled.samples == 31);
  int complete = 0;
  for (std::size_t w = 0; w < crowd.worlds(); ++w) {
    CHECK(same_row(plain.event_step, w, sampled.event_step, w, e));
    CHECK(same_row(plain.event_block, w, sampled.event_block, w, 2 * e));
    CHECK(same_row(plain.event_face, w, sampled.event_face, w, 2 * e));
    CHECK(same_row(plain.first_contact, w, sampled.first_contact, w, 1));
    CHECK(same_row(plain.assembly, w, sampled.assembly, w, k));
    CHECK(same_row(plain.cell, w, sampled.cell, w, 2 * k));
    CHECK(same_row(plain.quarter, w, sampled.quarter, w, k));
    CHECK(sampled.end_step[w] == steps);
    const std::int32_t events = plain.event_count[w];
    if (events + 1 == blocks) {
      ++complete;
      CHECK(plain.end_step[w] == plain.event_step[w * e + std::size_t(events) - 1]);
    } else {
      CHECK(plain.end_step[w] == steps);
      CHECK(same_row(plain.pose, w, sampled.pose, w, 3 * k));
    }
    // The start, and the number of assemblies at every sample.
    for (std::size_t b = 0; b < k; ++b) {
      CHECK(std::fabs(sampled.sample_pose[3 * (w * 31 * k + b)] - crowd.start[3 * (w * k + b)]) <
            1e-8);
    }
    for (std::size_t s = 0; s < 31; ++s) {
      const auto first =
          sampled.sample_assembly.begin() + std::ptrdiff_t((w * 31 + s) * sampled.blocks);
      const std::set<std::int32_t> roots(first, first + blocks);
      std::int32_t joined = 0;
      for (std::int32_t event = 0; event < events; ++event) {
        joined += plain.event_step[w * e + std::size_t(event)] <= std::int32_t(50 * s) ? 1 : 0;
      }
      CHECK(std::int32_t(roots.size()) == blocks - joined);
    }
  }
  std::printf("%d blocks: %d of 30 worlds complete\n", blocks, complete);
  CHECK(complete > 0 && complete < 30);
}

// --- one block ---

template <class T>
void check_one_block_in(Tank& tank) {
  tank.set_flow(swirl);
  tank.model.friction = 0.4;
  tank.sample_every(0.01, 301);
  const driftwalk::PreparedRun<double> prepared(tank.finished());
  const AssemblyRules rules = synthetic::rules_in(prepared, 1);
  const Crowd crowd = crowd_in(rules, 37);
  synthetic::Batch batch;
  for (std::size_t w = 0; w < crowd.worlds(); ++w) {
    batch.add(crowd.start[3 * w], crowd.start[3 * w + 1], crowd.start[3 * w + 2], 0, 0, 0,
              crowd.drag_coefficient[w], crowd.force_std[w]);
  }
  batch.key = crowd.key;
  const auto paths = synthetic::simulate<T>(tank, batch);
  const CrowdResults found = synthetic::assemble<T>(tank, rules, crowd, 300, 1);
  double farthest = -1;
  for (std::size_t w = 0; w < crowd.worlds(); ++w) {
    for (std::size_t s = 0; s <= 300; ++s) {
      const Square at = found.sampled(w, s, 0, side);
      const std::size_t k = w * 301 + s;
      CHECK(at.x == float(paths.x[k]) && at.y == float(paths.y[k]) &&
            at.theta == float(paths.theta[k]));
      farthest = std::max(farthest, squares::outside(tank, at));
    }
    CHECK(found.pose[3 * w] == paths.x[w * 301 + 300]);
    CHECK(found.event_count[w] == 0 && found.first_contact[w] == -1 && found.end_step[w] == 300);
  }
  CHECK(farthest > -1e-6); // walls were met
}

void check_one_block() {
  Tank circle, box = rectangle(), three = triangle(), floating;
  floating.let_float();
  check_one_block_in<float>(circle);
  check_one_block_in<double>(circle);
  check_one_block_in<float>(floating);
  check_one_block_in<double>(floating);
  check_one_block_in<float>(box);
  check_one_block_in<double>(box);
  check_one_block_in<float>(three);
}

// --- jams and extremes ---

struct Worst {
  double overlap = -1, outside = -1;
};

Worst worst_of(const Tank& tank, const CrowdResults& found) {
  Worst worst;
  for (std::size_t w = 0; w < found.status.size(); ++w) {
    CHECK(found.status[w] == 0);
    for (std::size_t s = 0; s < found.samples; ++s) {
      for (std::size_t a = 0; a < found.blocks; ++a) {
        const Square first = found.sampled(w, s, a, side);
        CHECK(std::isfinite(first.x + first.y) && std::fabs(first.theta) <= 3.1415928);
        worst.outside = std::max(worst.outside, squares::outside(tank, first));
        for (std::size_t b = a + 1; b < found.blocks; ++b) {
          const Square second = found.sampled(w, s, b, side);
          if (std::hypot(second.x - first.x, second.y - first.y) < 1.4143 * side) {
            worst.overlap = std::max(worst.overlap, squares::overlap(first, second));
          }
        }
      }
    }
  }
  return worst;
}

void check_jam(Tank tank, const char* name, int blocks, Latching latching, bool hidden_faces_drag) {
  tank.set_flow(swirl);
  const driftwalk::PreparedRun<double> prepared(tank.finished());
  AssemblyRules rules = synthetic::rules_in(prepared, blocks);
  rules.latching = latching;
  rules.hidden_share = hidden_faces_drag ? 1 : 0;
  rules.friction = hidden_faces_drag ? 0.5 : 0;
  const Crowd crowd = crowd_in(rules, 20);
  const CrowdResults found = synthetic::assemble<float>(tank, rules, crowd, 300, 3);
  const Worst worst = worst_of(tank, found);
  std::printf("%s, %d blocks, latching %d: overlap %.2g m, outside %.2g m\n", name, blocks,
              int(latching), worst.overlap, worst.outside);
  // A tenth of a millimetre, and the rounding of poses to float.
  CHECK(worst.overlap < 1.001e-4);
  CHECK(worst.outside < 1.001e-4);
  CHECK(worst.outside > -1e-3);
}

void check_jams() {
  for (const Latching latching : {Latching::none, Latching::collision, Latching::connector}) {
    for (const bool hidden : {false, true}) {
      check_jam(Tank(), "circle", 8, latching, hidden);
    }
    check_jam(rectangle(), "rectangle", 14, latching, false);
    check_jam(triangle(), "triangle", 12, latching, false);
  }
  check_jam(Tank(), "circle", 26, Latching::connector, false);
}

// Five blocks in line between walls that leave 2.4 mm: pushes alone cannot keep them inside.
void check_line_across() {
  Tank channel;
  channel.model.radius = 0;
  channel.edges = {0, -1, 0.0762, 1, 0, 0.2, 0, 1, 0.0762, -1, 0, 0.2};
  channel.set_flow(swirl);
  const driftwalk::PreparedRun<double> prepared(channel.finished());
  const AssemblyRules rules = synthetic::rules_in(prepared, 5);
  Crowd crowd(5);
  for (std::uint64_t k = 1; k <= 10; ++k) {
    crowd.add({0, -0.06, 0, 0, -0.03, 0, 0, 0, 0, 0, 0.03, 0, 0, 0.06, 0}, k, 1.0, 4e-3);
  }
  const CrowdResults found = synthetic::assemble<float>(channel, rules, crowd, 1000, 5);
  const Worst worst = worst_of(channel, found);
  double turned = 0;
  for (std::size_t w = 0; w < 10; ++w) {
    CHECK(found.event_count[w] == 4);
    for (std::size_t s = 1; s < found.samples; ++s) {
      turned = std::max(turned, std::fabs(found.sampled(w, s, 0, side).theta));
    }
  }
  std::printf("line across: outside %.2g m, turned by %.2g\n", worst.outside, turned);
  CHECK(worst.outside < 1.001e-4);
  CHECK(turned > 0.05 && turned < 0.12); // the corners of its ends stop it at 0.11
}

// --- events ---

// Plays the events back: two faces become neighbours on the lattice, every face joins once, and in
// the end the cells are those of the kernel.
void check_events() {
  Tank tank;
  tank.set_flow(swirl);
  const driftwalk::PreparedRun<double> prepared(tank.finished());
  AssemblyRules rules = synthetic::rules_in(prepared, 9);
  rules.latching = Latching::collision;
  const Crowd crowd = crowd_in(rules, 40);
  const CrowdResults found = synthetic::assemble<float>(tank, rules, crowd, 2000);
  const int step_x[] = {1, 0, -1, 0}, step_y[] = {0, 1, 0, -1};
  int events = 0;
  for (std::size_t w = 0; w < crowd.worlds(); ++w) {
    std::set<std::pair<int, int>> faces;
    std::vector<int> root;
    for (int b = 0; b < 9; ++b) {
      root.push_back(b);
    }
    int last = 1;
    for (std::size_t e = 0; e < std::size_t(found.event_count[w]); ++e, ++events) {
      const std::size_t row = w * found.events + e;
      CHECK(found.event_step[row] >= last);
      last = found.event_step[row];
      const int a = found.event_block[2 * row], b = found.event_block[2 * row + 1];
      const int root_a = root[std::size_t(a)], root_b = root[std::size_t(b)];
      CHECK(root_a != root_b);
      const auto size_a = std::count(root.begin(), root.end(), root_a);
      const auto size_b = std::count(root.begin(), root.end(), root_b);
      CHECK(size_a > size_b || (size_a == size_b && root_a < root_b));
      for (int& r : root) {
        r = r == root_a || r == root_b ? std::min(root_a, root_b) : r;
      }
      for (const std::size_t at : {2 * row, 2 * row + 1}) {
        CHECK(faces.insert({found.event_block[at], found.event_face[at]}).second);
      }
      // Own faces, turned by the final quarters, look at each other across neighbouring cells.
      const std::size_t block_a = w * 9 + std::size_t(a), block_b = w * 9 + std::size_t(b);
      const int face_a = (found.event_face[2 * row] + found.quarter[block_a]) & 3;
      const int face_b = (found.event_face[2 * row + 1] + found.quarter[block_b]) & 3;
      CHECK(face_b == ((face_a + 2) & 3));
      CHECK(found.cell[2 * block_b] - found.cell[2 * block_a] == step_x[face_a]);
      CHECK(found.cell[2 * block_b + 1] - found.cell[2 * block_a + 1] == step_y[face_a]);
    }
    CHECK(found.first_contact[w] <= found.event_step[w * found.events] ||
          found.event_count[w] == 0);
    CHECK((found.end_step[w] < 2000) == (found.event_count[w] == 8 && last < 2000));
    for (std::size_t a = 0; a < 9; ++a) {
      const std::size_t first = w * 9 + a;
      CHECK(found.assembly[first] == root[a]);
      for (std::size_t b = 0; b < a; ++b) {
        const std::size_t second = w * 9 + b;
        if (root[a] != root[b]) {
          continue;
        }
        // Poses on the lattice, to float precision.
        const double turn = found.pose[3 * first + 2] - found.quarter[first] * pi / 2;
        const double dx = found.pose[3 * second] - found.pose[3 * first];
        const double dy = found.pose[3 * second + 1] - found.pose[3 * first + 1];
        const double along = dx * std::cos(turn) + dy * std::sin(turn);
        const double across = dy * std::cos(turn) - dx * std::sin(turn);
        const int cells_x = found.cell[2 * second] - found.cell[2 * first];
        const int cells_y = found.cell[2 * second + 1] - found.cell[2 * first + 1];
        CHECK_NEAR(along, side * cells_x, 2e-7);
        CHECK_NEAR(across, side * cells_y, 2e-7);
        CHECK(cells_x != 0 || cells_y != 0);
        const double angle = found.pose[3 * second + 2] - found.quarter[second] * pi / 2 - turn;
        CHECK_NEAR(std::cos(angle), 1.0, 1e-12);
      }
    }
  }
  std::printf("events: %d\n", events);
  CHECK(events > 60);
}

// --- connectors at rest ---

// Whether two faces of two squares are within tolerance: 1 yes, 0 no, -1 too close to tell.
int faces_meet(const Square& a, const Square& b, double distance, double axis) {
  int answer = 0;
  for (int f = 0; f < 16; ++f) {
    const double n = a.theta + f / 4 * pi / 2, m = b.theta + f % 4 * pi / 2;
    const double dx = b.x + side / 2 * std::cos(m) - a.x - side / 2 * std::cos(n);
    const double dy = b.y + side / 2 * std::sin(m) - a.y - side / 2 * std::sin(n);
    const double gap = std::hypot(dx, dy), turned = std::acos(-std::cos(n - m));
    if (gap < distance - 1e-6 && turned < axis - 1e-5) {
      return 1;
    }
    answer = gap < distance + 1e-6 && turned < axis + 1e-5 ? -1 : answer;
  }
  return answer;
}

// Blocks at rest in still water: what is within tolerance latches in the first step, nothing else.
void check_connectors_at_rest() {
  Tank tank;
  tank.set_flow([](double, double, double& u, double& v) { u = v = 0; });
  const driftwalk::PreparedRun<double> prepared(tank.finished());
  for (const double axis : {0.05, 0.2, 0.75, 1.2, 2.0, 3.14}) {
    for (const double distance : {0.0, 0.002, 0.01, 0.04}) {
      AssemblyRules rules = synthetic::rules_in(prepared, 2);
      rules.connector_distance = distance;
      rules.connector_cosine = std::cos(axis);
      synthetic::Uniform draw;
      Crowd crowd(2);
      std::vector<int> expected;
      while (expected.size() < 200) {
        const Square a{0.03 * draw(), 0.03 * draw(), pi * draw(), side};
        const double away = 0.03 + 0.03 * (draw() + 1), heading = pi * draw();
        const double turned = a.theta + axis * 1.2 * draw() + pi / 2 * std::round(2 * draw());
        const Square b{a.x + away * std::cos(heading), a.y + away * std::sin(heading), turned,
                       side};
        const int meet = faces_meet(a, b, distance, axis);
        if (meet < 0 || std::fabs(squares::overlap(a, b)) < 1e-6) {
          continue;
        }
        expected.push_back(meet);
        crowd.add({a.x, a.y, a.theta, b.x, b.y, b.theta}, 1, 0, 0);
      }
      const CrowdResults found = synthetic::assemble<float>(tank, rules, crowd, 1);
      int latched = 0;
      for (std::size_t w = 0; w < expected.size(); ++w) {
        CHECK(found.event_count[w] == expected[w]);
        latched += found.event_count[w];
      }
      CHECK(latched > 5 || distance < 0.01);
    }
  }
}

// --- the energy of hard bodies ---

// A world in free motion, driven step by step: the kernel starts blocks at rest, so it gives the
// parts and the test the motion.
class FreeWorld {
public:
  using Member = driftwalk::Member<double>;

  FreeWorld(Tank& tank, const AssemblyRules& rules, const Crowd& crowd, double drag = 0,
            double noise_scale = 0)
      : rules_(rules), memory_(driftwalk::PackMemory<double>::bytes(rules.blocks) + 64),
        pack_(aligned(), rules.blocks, true), blocks_(std::size_t(rules.blocks)),
        before_(blocks_.size()), assemblies_(blocks_.size()),
        pairs_(std::size_t(driftwalk::pair_capacity(rules.blocks))), close_(pairs_.size()),
        by_cell_(blocks_.size()), heads_(driftwalk::cell_heads), next_(blocks_.size()),
        run_(tank.finished()) {
    const driftwalk::Prepared<double>& run = run_.view();
    physics_ = {
        {},
        run.block,
        run.shape,
        run.flow,
        run.water,
        run.wall,
        run.step,
        {drag * run.drag_scale / run.mass, drag * run.drag_scale / run.inertia, noise_scale}};
    driftwalk::AssemblyWorlds worlds;
    worlds.start = crowd.start.data();
    driftwalk::load_lane<double, double>(rules, worlds.start, pack_, 0);
    scene_.block = blocks_.data();
    scene_.blocks_before = before_.data();
    scene_.assembly = assemblies_.data();
    scene_.pairs = {pairs_.data(), 0, static_cast<int>(pairs_.size()), nullptr, nullptr};
    scene_.by_cell = by_cell_.data();
    scene_.close = {close_.data(), 0, static_cast<int>(close_.size()), nullptr, nullptr};
    scene_.cell_head = heads_.data();
    scene_.cell_next = next_.data();
    for (int b = 0; b < rules.blocks; ++b) {
      std::fill_n(member(b).normals, 4, 0.0);
    }
  }
  Member& member(int b) { return pack_.members[b]; }
  void step() {
    const auto sum = [&]<int Count>() {
      driftwalk::sum_masked<Count>(pack_.members, pack_.sums, rules_.blocks);
    };
    driftwalk::advance(physics_, 0, pack_.members, pack_.sums, rules_.blocks, sum, [] {});
    driftwalk::meet_walls(physics_, pack_.members, rules_.blocks);
    driftwalk::fill_scene(rules_, pack_, 0, assemblies_left_, scene_);
    driftwalk::find_pairs(rules_, scene_);
    driftwalk::settle(rules_, scene_);
    driftwalk::read_scene(rules_, scene_, pack_, 0);
    assemblies_left_ = scene_.assemblies;
  }
  double energy() {
    double sum = 0;
    for (int b = 0; b < rules_.blocks; ++b) {
      const driftwalk::Motion<double>& v = member(b).motion;
      sum += (rules_.mass * (v.vx * v.vx + v.vy * v.vy) + rules_.inertia * v.omega * v.omega) / 2;
    }
    return sum;
  }

private:
  void* aligned() {
    void* at = memory_.data();
    std::size_t space = memory_.size();
    return std::align(64, space - 63, at, space);
  }
  const AssemblyRules& rules_;
  int assemblies_left_ = rules_.blocks;
  std::vector<char> memory_;
  driftwalk::PackMemory<double> pack_;
  std::vector<driftwalk::SceneBlock> blocks_, before_;
  std::vector<driftwalk::SceneAssembly> assemblies_;
  std::vector<driftwalk::BlockPair> pairs_, close_;
  std::vector<driftwalk::PlacedBlock> by_cell_;
  std::vector<std::int32_t> heads_, next_;
  driftwalk::PreparedRun<double> run_;
  driftwalk::Physics<double, double, driftwalk::QuadraticDrag> physics_{};
  driftwalk::Scene scene_{};
};

// Without drag and force nothing ever gains energy; with e = 1 and no friction little is lost:
// only impacts below the bounce speed take something.
void check_energy(Tank tank, const char* name, double restitution, double friction) {
  tank.model.restitution = restitution;
  tank.model.friction = friction;
  tank.set_flow([](double, double, double& u, double& v) { u = v = 0; });
  const driftwalk::PreparedRun<double> prepared(tank.finished());
  AssemblyRules rules = synthetic::rules_in(prepared, 10);
  rules.latching = Latching::none;
  rules.restitution = restitution;
  rules.friction = friction;
  FreeWorld world(tank, rules, crowd_in(rules, 1));
  synthetic::Uniform draw;
  for (int b = 0; b < 10; ++b) {
    world.member(b).motion = {0.15 * draw(), 0.15 * draw(), 5 * draw()};
  }
  const double first = world.energy();
  double before = first, gained = 0;
  for (int k = 0; k < 4000; ++k) {
    world.step();
    const double after = world.energy();
    gained = std::max(gained, after - before);
    before = after;
  }
  std::printf("%s, e %g, friction %g: energy left %.3g, gained in a step %.2g\n", name, restitution,
              friction, before / first, gained / first);
  CHECK(gained < 1e-13 * first);
  CHECK(restitution == 1 && friction == 0 ? before > 0.95 * first : before < 0.2 * first);
}

// --- a step of an assembly in motion ---

struct Load {
  double x = 0, y = 0, torque = 0;   // [N, N m] about the centre of mass
  double slip = 0, turning_slip = 0; // sums of s, and of s (4/3 h^2 + r^2)
};

// Drag on an assembly by its definition: strip after strip in the water (-turning y, turning x).
Load drag_by_strips(FreeWorld& world, int blocks, bool hidden, double drag, double turning,
                    const driftwalk::Pose<double>& pose, const driftwalk::Motion<double>& v) {
  const double h = side / 2, per_strip = 0.5 * 1000 * drag * (side / 8) * side;
  const double c = std::cos(pose.theta), s = std::sin(pose.theta);
  Load load;
  for (int b = 0; b < blocks; ++b) {
    const double ox = world.member(b).offset_x, oy = world.member(b).offset_y;
    for (int face = 0; face < 4; ++face) {
      bool open = true;
      const double ax = std::cos(face * pi / 2), ay = std::sin(face * pi / 2);
      for (int other = 0; other < blocks && !hidden; ++other) {
        open = open && std::hypot(ox + side * ax - world.member(other).offset_x,
                                  oy + side * ay - world.member(other).offset_y) > 1e-6;
      }
      for (int k = 0; k < 8 && open; ++k) {
        const double along = side * ((k + 0.5) / 8 - 0.5);
        const double fx = ox + h * ax - along * ay, fy = oy + h * ay + along * ax;
        const double rx = c * fx - s * fy, ry = s * fx + c * fy;
        const double wx = -turning * (pose.y + ry) - (v.vx - v.omega * ry);
        const double wy = turning * (pose.x + rx) - (v.vy + v.omega * rx);
        const double nx = c * ax - s * ay, ny = s * ax + c * ay;
        const double slip = std::max(0.0, -(nx * wx + ny * wy));
        load.x += per_strip * slip * wx;
        load.y += per_strip * slip * wy;
        load.torque += per_strip * slip * (rx * wy - ry * wx);
        load.slip += per_strip * slip;
        load.turning_slip += per_strip * slip * (4.0 / 3 * h * h + ox * ox + oy * oy);
      }
    }
  }
  return load;
}

// One step of random motion, drag and force against the scheme on paper.
void check_step_of_an_assembly() {
  const double shapes[][8] = {{0, 0, side, 0}, {0, 0, side, 0, 0, side}, {0, 0, 0, side, 0, -side}};
  const int sizes[] = {2, 3, 3};
  const double turning = 0.7, drag = 1.3, noise_scale = 0.05, dt = 0.01, mass = 0.0116;
  Tank tank;
  tank.model.radius = 0.3;
  tank.set_flow([&](double x, double y, double& u, double& v) {
    u = -turning * y;
    v = turning * x;
  });
  const driftwalk::PreparedRun<double> prepared(tank.finished());
  synthetic::Uniform draw;
  double worst = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const int n = sizes[trial % 3];
    const bool hidden = trial % 2 == 1;
    AssemblyRules rules = synthetic::rules_in(prepared, n);
    rules.hidden_share = hidden ? 1 : 0;
    Crowd crowd(n);
    std::vector<double> start;
    const double heading = pi * draw(), at_x = 0.05 * draw(), at_y = 0.05 * draw();
    for (int b = 0; b < n; ++b) {
      const double x = shapes[trial % 3][2 * b], y = shapes[trial % 3][2 * b + 1];
      start.push_back(at_x + x * std::cos(heading) - y * std::sin(heading));
      start.push_back(at_y + x * std::sin(heading) + y * std::cos(heading));
      start.push_back(heading);
    }
    crowd.add(start, 1, 0, 0);
    FreeWorld world(tank, rules, crowd, drag, noise_scale);
    world.step(); // they latch
    const driftwalk::Motion<double> v{0.2 * draw(), 0.2 * draw(), 4 * draw()};
    const driftwalk::Pose<double> from = world.member(0).pose;
    double ex = 0, ey = 0, torque = 0, inertia = 0;
    for (int b = 0; b < n; ++b) {
      FreeWorld::Member& m = world.member(b);
      CHECK(m.root == 0);
      m.motion = v;
      m.drag = {0, 0, 0};
      m.normals[0] = draw();
      m.normals[1] = draw();
      const double c = std::cos(from.theta), s = std::sin(from.theta);
      const double rx = c * m.offset_x - s * m.offset_y, ry = s * m.offset_x + c * m.offset_y;
      ex += noise_scale * m.normals[0] / n;
      ey += noise_scale * m.normals[1] / n;
      torque += mass * noise_scale * (rx * m.normals[1] - ry * m.normals[0]);
      inertia += mass * (side * side / 6 + rx * rx + ry * ry);
    }
    const double spin = torque / inertia, whole = n * mass;
    const driftwalk::Motion<double> ahead{v.vx + dt / 2 * ex, v.vy + dt / 2 * ey,
                                          v.omega + dt / 2 * spin};
    const Load load =
        drag_by_strips(world, n, hidden, drag, turning,
                       {from.x + dt / 4 * (v.vx + ahead.vx), from.y + dt / 4 * (v.vy + ahead.vy),
                        from.theta + dt / 4 * (v.omega + ahead.omega)},
                       ahead);
    const double damping = 1 + dt / 2 * load.slip / whole;
    const driftwalk::Motion<double> mean{
        ahead.vx + dt / 2 * load.x / whole / damping, ahead.vy + dt / 2 * load.y / whole / damping,
        ahead.omega + dt / 2 * load.torque / inertia / (1 + dt / 2 * load.turning_slip / inertia)};
    world.step();
    const FreeWorld::Member& m = world.member(n - 1);
    worst = std::max({worst, std::fabs(m.pose.x - from.x - dt * mean.vx) / dt,
                      std::fabs(m.pose.y - from.y - dt * mean.vy) / dt,
                      std::fabs(std::sin(m.pose.theta - from.theta - dt * mean.omega)) / dt * side,
                      std::fabs(m.motion.vx - (2 * mean.vx - v.vx)),
                      std::fabs(m.motion.omega - (2 * mean.omega - v.omega)) * side});
  }
  std::printf("a step of an assembly: off by %.2g m/s\n", worst);
  CHECK(worst < 1e-12);
}

// Two blocks alone, far from any wall: the momentum stays through impact after impact.
void check_isolated_pair() {
  Tank tank;
  tank.model.radius = 10;
  tank.nodes = 3;
  tank.spacing = 10;
  tank.set_flow([](double, double, double& u, double& v) { u = v = 0; });
  const driftwalk::PreparedRun<double> prepared(tank.finished());
  AssemblyRules rules = synthetic::rules_in(prepared, 2);
  rules.latching = Latching::none;
  rules.friction = 0.8;
  Crowd crowd(2);
  crowd.add({0, 0, 0.3, 0.06, 0.004, 1.0}, 1, 0, 0);
  FreeWorld world(tank, rules, crowd);
  world.member(0).motion = {0.2, 0.01, 3};
  world.member(1).motion = {-0.1, -0.02, -6};
  for (int k = 0; k < 300; ++k) {
    world.step();
    const auto &a = world.member(0).motion, &b = world.member(1).motion;
    CHECK_NEAR(a.vx + b.vx, 0.1, 1e-14);
    CHECK_NEAR(a.vy + b.vy, -0.01, 1e-14);
  }
  CHECK(world.member(0).motion.vx < 0.19); // they did meet
}

} // namespace

int main() {
  Tank floating;
  floating.let_float();
  check_same_bits(Tank(), 1, 20, 200);
  check_same_bits(Tank(), 4, 50, 700);
  check_same_bits(floating, 4, 50, 700);
  check_same_bits(Tank(), 9, 20, 300);
  check_same_bits(Tank(), 24, 18, 150);
  check_same_bits(Tank(), 25, 18, 150);
  check_same_bits(floating, 25, 18, 150);
  check_sampling(4);
  check_sampling(8);
  check_one_block();
  check_jams();
  check_line_across();
  check_events();
  check_connectors_at_rest();
  for (const double restitution : {1.0, 0.5}) {
    for (const double friction : {0.0, 0.6}) {
      check_energy(Tank(), "circle", restitution, friction);
      check_energy(triangle(), "triangle", restitution, friction);
    }
  }
  check_isolated_pair();
  check_step_of_an_assembly();
  return check::result();
}
