// Which blocks of a scene are near each other: all pairs of a few, a grid of cells for many.
#include "driftwalk/assembly/settle_parts.hpp"

#include <algorithm>
#include <cmath>

namespace driftwalk {

namespace {
double list_reach(const AssemblyRules& rules) {
  const double touching = rules.side * std::sqrt(2.0);
  const double latching =
      rules.latching == Latching::connector ? rules.side + rules.connector_distance : 0.0;
  return std::max({touching, latching, rules.pull.on ? rules.pull.reach : 0.0}) +
         pair_skin_sides * rules.side;
}

bool are_near(const Scene& scene, int a, int b, double reach) {
  const Vec2 between = centre(scene, b) - centre(scene, a);
  return dot(between, between) < reach * reach;
}

void add_pair(PairList& pairs, int a, int b) {
  pairs.pair[pairs.count++] = {std::min(a, b), std::max(a, b)};
}

void find_among_all(Scene& scene, double reach) {
  for (int a = 0; a < scene.blocks; ++a) {
    for (int b = a + 1; b < scene.blocks; ++b) {
      if (are_near(scene, a, b, reach)) {
        add_pair(scene.pairs, a, b);
      }
    }
  }
}

// Cells no smaller than the reach: what is near lies in the same cell or a neighbouring one.
struct Cells {
  double low_x, low_y, per_size;
  int columns, rows;

  Cells(const AssemblyRules& rules, double reach) : low_x(rules.low_x), low_y(rules.low_y) {
    const double width = rules.high_x - rules.low_x, height = rules.high_y - rules.low_y;
    const double size =
        std::max({reach, width / most_cells_per_side, height / most_cells_per_side});
    per_size = 1.0 / size;
    columns = std::min(static_cast<int>(width * per_size) + 1, most_cells_per_side);
    rows = std::min(static_cast<int>(height * per_size) + 1, most_cells_per_side);
  }
  // A position that is no number, or far outside, counts to a cell at the edge.
  static int at(double position, double low, double per_cell, int cells) {
    const double cell = (position - low) * per_cell;
    return cell > 0 ? static_cast<int>(std::min(cell, cells - 1.0)) : 0;
  }
  int column(double x) const { return at(x, low_x, per_size, columns); }
  int row(double y) const { return at(y, low_y, per_size, rows); }
};

void find_in_cells(const AssemblyRules& rules, Scene& scene, double reach) {
  const Cells cells(rules, reach);
  std::fill_n(scene.cell_head, cells.columns * cells.rows, -1);
  // A block meets those of lower index that are in the cells already.
  for (int b = 0; b < scene.blocks; ++b) {
    const int column = cells.column(scene.block[b].x), row = cells.row(scene.block[b].y);
    for (int r = std::max(row - 1, 0); r <= std::min(row + 1, cells.rows - 1); ++r) {
      for (int c = std::max(column - 1, 0); c <= std::min(column + 1, cells.columns - 1); ++c) {
        for (int other = scene.cell_head[r * cells.columns + c]; other >= 0;
             other = scene.cell_next[other]) {
          if (are_near(scene, other, b, reach)) {
            add_pair(scene.pairs, other, b);
          }
        }
      }
    }
    std::int32_t& head = scene.cell_head[row * cells.columns + column];
    scene.cell_next[b] = head;
    head = b;
  }
}
} // namespace

void find_pairs(const AssemblyRules& rules, Scene& scene) {
  const double reach = list_reach(rules);
  PairList& pairs = scene.pairs;
  pairs.count = 0;
  if (scene.blocks <= most_blocks_all_pairs) {
    find_among_all(scene, reach);
    return;
  }
  find_in_cells(rules, scene, reach);
  std::sort(pairs.pair, pairs.pair + pairs.count, [](const BlockPair& a, const BlockPair& b) {
    return a.first != b.first ? a.first < b.first : a.second < b.second;
  });
}

} // namespace driftwalk
