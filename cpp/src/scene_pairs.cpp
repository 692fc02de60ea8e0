// Which blocks of a scene are near each other: all pairs of a few, a grid of cells for many.
#include "driftwalk/assembly/settle_parts.hpp"

#include <algorithm>
#include <cmath>

namespace driftwalk {

namespace {
// No pair farther apart than this touches or latches.
double touching_reach(const AssemblyRules& rules) {
  const double touching = std::sqrt(square_of_diagonal(rules));
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

void make_room(PairList& pairs, int count) {
  if (count > pairs.room) {
    pairs.room = 2 * count;
    pairs.pair = pairs.grow(pairs.owner, pairs.room);
  }
}

void add_pair(PairList& pairs, int a, int b) {
  make_room(pairs, pairs.count + 1);
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

// The blocks, cell by cell: those of cell c from cell_head[c] on, up to cell_head[c + 1].
void sort_into_cells(const Cells& cells, Scene& scene) {
  const int count = cells.columns * cells.rows;
  std::int32_t* const head = scene.cell_head;
  std::fill_n(head, count + 2, 0);
  for (int b = 0; b < scene.blocks; ++b) {
    scene.cell_next[b] = cells.of(scene.block[b]);
    ++head[scene.cell_next[b] + 2];
  }
  for (int cell = 2; cell <= count + 1; ++cell) {
    head[cell] += head[cell - 1];
  }
  // A cell's beginning moves to its end, which is the beginning of the next one.
  for (int b = 0; b < scene.blocks; ++b) {
    const SceneBlock& block = scene.block[b];
    scene.by_cell[head[scene.cell_next[b] + 1]++] = {block.x, block.y, block.assembly, b};
  }
}

// Pairs of a block with those of a range of cells, in the order of the cells.
void pair_with(const PlacedBlock& one, const PlacedBlock* other, const PlacedBlock* end,
               double squared, PairList& pairs) {
  for (; other < end; ++other) {
    const Vec2 between{other->x - one.x, other->y - one.y};
    if (other->assembly != one.assembly && dot(between, between) < squared) {
      add_pair(pairs, one.block, other->block);
    }
  }
}

// Each cell with itself and with half of its neighbours, so that every pair comes once.
void find_in_cells(const Cells& cells, double reach, Scene& scene, PairList& pairs) {
  sort_into_cells(cells, scene);
  const auto begin_of = [&](int row, int column) {
    return scene.by_cell + scene.cell_head[row * cells.columns + column];
  };
  for (int row = 0; row < cells.rows; ++row) {
    for (int column = 0; column < cells.columns; ++column) {
      const PlacedBlock *one = begin_of(row, column), *const end = begin_of(row, column + 1);
      const int left = std::max(column - 1, 0), right = std::min(column + 1, cells.columns - 1);
      for (; one < end; ++one) {
        // Neighbouring cells of a row follow each other.
        pair_with(*one, one + 1, begin_of(row, right + 1), reach * reach, pairs);
        if (row + 1 < cells.rows) {
          pair_with(*one, begin_of(row + 1, left), begin_of(row + 1, right + 1), reach * reach,
                    pairs);
        }
      }
    }
  }
}

// Puts pairs into another list by their first block, and of each by the second.
void sort_pairs(const PairList& from, Scene& scene, PairList& to) {
  std::int32_t* const end = scene.cell_next;
  std::fill_n(end, scene.blocks, 0);
  for (int k = 0; k < from.count; ++k) {
    ++end[from.pair[k].first];
  }
  int begin = 0;
  for (int b = 0; b < scene.blocks; ++b) {
    begin += end[b];
    end[b] = begin - end[b];
  }
  make_room(to, from.count);
  to.count = from.count;
  for (int k = 0; k < from.count; ++k) {
    to.pair[end[from.pair[k].first]++] = from.pair[k];
  }
  for (int b = 0; b < scene.blocks; ++b) {
    std::sort(to.pair + (b == 0 ? 0 : end[b - 1]), to.pair + end[b],
              [](const BlockPair& one, const BlockPair& two) { return one.second < two.second; });
  }
}
} // namespace

void find_pairs(const AssemblyRules& rules, Scene& scene) {
  const double pulling = rules.pull.on ? rules.pull.reach : 0.0;
  // Blocks move on before the list is looked at again, by less than 0.1 sides a step.
  const double ahead = rules.pull.on ? 0.1 * rules.side : 0.0;
  const double reach =
      std::max(touching_reach(rules), pulling + ahead) + pair_skin_sides * rules.side;
  PairList& pairs = scene.pairs;
  pairs.count = 0;
  if (scene.blocks <= most_blocks_all_pairs) {
    find_among_all(scene, reach);
    return;
  }
  scene.close.count = 0; // scratch
  find_in_cells(Cells(rules, reach), reach, scene, scene.close);
  sort_pairs(scene.close, scene, pairs);
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
