// Random start poses: apart, inside, the same for the same key, and an honest count of what fits.
#include "check.hpp"
#include "synthetic_assembly.hpp"

#include <vector>

namespace {

using squares::Square;
using synthetic::Tank;

std::vector<Square> placed(const driftwalk::AssemblyRules& rules, std::uint64_t key, int& count) {
  std::vector<double> poses(3 * static_cast<std::size_t>(rules.blocks));
  count = driftwalk::place_blocks(rules, key, poses.data());
  std::vector<Square> found;
  for (std::size_t b = 0; b < poses.size(); b += 3) {
    found.push_back({poses[b], poses[b + 1], poses[b + 2], rules.side});
  }
  return found;
}

void check_placed(Tank& tank, int blocks, int worlds) {
  tank.set_flow([](double, double, double& u, double& v) { u = v = 0; });
  const driftwalk::PreparedRun<double> prepared(tank.finished());
  const driftwalk::AssemblyRules rules = synthetic::rules_in(prepared, blocks);
  double deepest = -1, farthest = -1;
  for (int world = 0; world < worlds; ++world) {
    int count = 0;
    const auto key = static_cast<std::uint64_t>(world) * 77777;
    const std::vector<Square> blocks_placed = placed(rules, key, count);
    CHECK(count == blocks);
    for (std::size_t a = 0; a < blocks_placed.size(); ++a) {
      farthest = std::max(farthest, squares::outside(tank, blocks_placed[a]));
      CHECK(std::fabs(blocks_placed[a].theta) <= squares::pi);
      for (std::size_t b = a + 1; b < blocks_placed.size(); ++b) {
        deepest = std::max(deepest, squares::overlap(blocks_placed[a], blocks_placed[b]));
      }
    }
    int again = 0;
    const std::vector<Square> repeated = placed(rules, key, again);
    for (std::size_t b = 0; b < repeated.size(); ++b) {
      CHECK(repeated[b].x == blocks_placed[b].x && repeated[b].y == blocks_placed[b].y &&
            repeated[b].theta == blocks_placed[b].theta);
    }
  }
  CHECK(deepest < 1e-15);
  CHECK(farthest < 1e-15);
  // They come close to each other and to the wall: the bounds above are not idle.
  CHECK(blocks == 1 || deepest > -0.01);
  CHECK(blocks == 1 || farthest > -0.01);
}

// No attempt can place what has no room, and the count says how many could be.
void check_too_many() {
  Tank tank;
  tank.model.radius = 0.04;
  tank.set_flow([](double, double, double& u, double& v) { u = v = 0; });
  const driftwalk::PreparedRun<double> prepared(tank.finished());
  const driftwalk::AssemblyRules rules = synthetic::rules_in(prepared, 12);
  for (std::uint64_t key = 0; key < 3; ++key) {
    int count = 0;
    placed(rules, key, count);
    // Two always fit beside each other; the area holds five.
    CHECK(count >= 2 && count <= 5);
  }
  Tank narrow;
  narrow.model.radius = 0.02; // less than half a block's diagonal
  narrow.set_flow([](double, double, double& u, double& v) { u = v = 0; });
  const driftwalk::PreparedRun<double> no_room(narrow.finished());
  int count = -1;
  placed(synthetic::rules_in(no_room, 1), 1, count);
  CHECK(count == 0);
}

} // namespace

int main() {
  Tank circle;
  check_placed(circle, 1, 20);
  check_placed(circle, 4, 20);
  check_placed(circle, 24, 4);
  Tank rectangle;
  rectangle.model.radius = 0;
  rectangle.edges = {0, -1, 0.08, 1, 0, 0.12, 0, 1, 0.08, -1, 0, 0.12};
  check_placed(rectangle, 8, 10);
  Tank triangle;
  triangle.model.radius = 0;
  const double s = std::sqrt(0.75);
  triangle.edges = {0, -1, 0.08, s, 0.5, 0.08, -s, 0.5, 0.08};
  check_placed(triangle, 6, 10);
  check_too_many();
  return check::result();
}
