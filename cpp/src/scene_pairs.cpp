// Which blocks of a scene are near each other: all pairs of a few, a grid of cells for many.
#include "driftwalk/assembly/settle_parts.hpp"

#include <algorithm>
#include <cmath>

namespace driftwalk {

namespace {
// No pair farther apart than this touches or latches.
double touching_reach(const AssemblyRules& rules) {
  const double touching = rules.side * std::sqrt(2.0);
  const double latching =
      rules.latching == Latching::connector ? rules.side + rules.connector_distance : 0.0;
  return std::max(touching, latching);
}

// Of two assemblies: what one holds does not touch.
bool are_near(const Scene& scene, int a, int b, double reach) {
  if (scene.block[a].assembly == scene.block[b].assembly) {
    return false;
  }
  const Vec2 between = centre(scene, b) - centre(scene, a);
  return dot(between, between) < reach * reach;
}

void add_pair(PairList& pairs, int a, int b) {
  if (pairs.count == pairs.room) {
    pairs.room *= 2;
    pairs.pair = pairs.grow(pairs.owner, pairs.room);
  }
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
  int of(const SceneBlock& block) const { return row(block.y) * columns + column(block.x); }
};

// The blocks sorted by cell, and in a cell by index.
void sort_into_cells(const Cells& cells, Scene& scene) {
  const int count = cells.columns * cells.rows;
  std::fill_n(scene.cell_head, count + 2, 0);
  for (int b = 0; b < scene.blocks; ++b) {
    ++scene.cell_head[cells.of(scene.block[b]) + 1];
  }
  for (int cell = 0; cell < count; ++cell) {
    scene.cell_head[cell + 1] += scene.cell_head[cell];
  }
  scene.cell_head[count + 1] = scene.blocks;
  // From the last one down: of each cell the end, one place on, becomes the beginning.
  for (int b = scene.blocks - 1; b >= 0; --b) {
    std::int32_t& end = scene.cell_head[cells.of(scene.block[b]) + 1];
    scene.cell_next[--end] = b;
  }
}

void find_in_cells(const AssemblyRules& rules, Scene& scene, double reach) {
  const Cells cells(rules, reach);
  sort_into_cells(cells, scene);
  for (int b = 0; b < scene.blocks; ++b) {
    const int column = cells.column(scene.block[b].x), row = cells.row(scene.block[b].y);
    const int left = std::max(column - 1, 0), right = std::min(column + 1, cells.columns - 1);
    const int begin = scene.pairs.count;
    for (int r = std::max(row - 1, 0); r <= std::min(row + 1, cells.rows - 1); ++r) {
      // Neighbouring cells of a row follow each other.
      const int end = scene.cell_head[r * cells.columns + right + 2];
      for (int k = scene.cell_head[r * cells.columns + left + 1]; k < end; ++k) {
        const int other = scene.cell_next[k];
        if (other > b && are_near(scene, b, other, reach)) {
          add_pair(scene.pairs, b, other);
        }
      }
    }
    BlockPair* const own = scene.pairs.pair + begin;
    std::sort(own, scene.pairs.pair + scene.pairs.count,
              [](const BlockPair& one, const BlockPair& two) { return one.second < two.second; });
  }
}
} // namespace

void find_pairs(const AssemblyRules& rules, Scene& scene) {
  const double pulling = rules.pull.on ? rules.pull.reach : 0.0;
  const double reach = std::max(touching_reach(rules), pulling) + pair_skin_sides * rules.side;
  PairList& pairs = scene.pairs;
  pairs.count = 0;
  if (scene.blocks <= most_blocks_all_pairs) {
    find_among_all(scene, reach);
    return;
  }
  find_in_cells(rules, scene, reach);
}

void find_close_pairs(const AssemblyRules& rules, Scene& scene) {
  const double reach = touching_reach(rules) * (1 + 1e-9); // rounding loses no pair
  scene.close.count = 0;
  for (int k = 0; k < scene.pairs.count; ++k) {
    const BlockPair pair = scene.pairs.pair[k];
    if (are_near(scene, pair.first, pair.second, reach)) {
      add_pair(scene.close, pair.first, pair.second);
    }
  }
}

} // namespace driftwalk
