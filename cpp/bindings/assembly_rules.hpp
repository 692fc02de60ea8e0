// What the bindings of self-assembly share: rules from a model and from words.
#pragma once

#include "model.hpp"

#include "driftwalk/assembly/rules.hpp"

#include <cmath>
#include <stdexcept>
#include <string>
#include <tuple>

// What the rules take from the model.
inline driftwalk::AssemblyRules rules_of(const Model& model, std::size_t blocks) {
  const driftwalk::Prepared<double>& run = model.twice().view();
  driftwalk::AssemblyRules rules;
  rules.blocks = static_cast<int>(blocks);
  rules.side = 2 * run.block.half_side;
  rules.round = run.shape.disc_radius > 0;
  rules.width = 2 * run.shape.half_width;
  // Where blocks meet only ratios of the two count, and an added share is common to both.
  rules.mass = model.numbers().mass;
  rules.inertia = model.numbers().inertia;
  rules.radius = run.wall.radius;
  rules.edges = run.wall.edges;
  rules.edge_count = run.wall.edge_count;
  rules.low_x = run.flow.low_x;
  rules.high_x = run.flow.high_x;
  rules.low_y = run.flow.low_y;
  rules.high_y = run.flow.high_y;
  rules.bounce_speed = run.wall.bounce_speed;
  return rules;
}

inline driftwalk::Latching latching_of(const std::string& word) {
  if (word == "none") {
    return driftwalk::Latching::none;
  }
  if (word == "collision") {
    return driftwalk::Latching::collision;
  }
  if (word == "connector") {
    return driftwalk::Latching::connector;
  }
  throw std::invalid_argument("latching must be none, collision or connector");
}

inline bool is_first(const std::string& word, const char* first, const char* second) {
  if (word != first && word != second) {
    throw std::invalid_argument(word + " must be " + first + " or " + second);
  }
  return word == first;
}

// What is shared: the drag of joined faces, and the stochastic force over a length [m].
inline void set_shared(driftwalk::AssemblyRules& rules, double hidden_share, double stirring_length,
                       bool incompressible) {
  if (!(hidden_share >= 0 && hidden_share <= 1)) {
    throw std::invalid_argument("hidden_share must be from 0 to 1");
  }
  if (!(stirring_length >= 0 && stirring_length < 1e6)) {
    throw std::invalid_argument("stirring_length must be finite and not negative");
  }
  rules.hidden_share = hidden_share;
  rules.stirring_length = stirring_length;
  rules.incompressible = incompressible;
}

// When bonds break, and when what has parted latches again: (rate [1/s], force [N], strength [N],
// clearance [side]).
using BondNumbers = std::tuple<double, double, double, double>;

inline void set_bonds(driftwalk::AssemblyRules& rules, const BondNumbers& bonds) {
  const auto [rate, force, strength, clearance] = bonds;
  if (!(rate >= 0 && force >= 0 && strength >= 0 && rate + force + strength < 1e12)) {
    throw std::invalid_argument("rate, force and strength of bonds must be finite, not negative");
  }
  if (!(clearance >= 1 && clearance <= 2)) {
    throw std::invalid_argument("relatch_clearance must be from 1 to 2 sides");
  }
  rules.bond_rate = rate;
  rules.bond_force = force;
  rules.bond_strength = strength;
  rules.relatch_clearance = clearance;
  rules.bonds_break = rate > 0 || strength > 0;
}

using Cells = std::optional<In<std::int32_t, 2>>;

// The cells (glued, 2) of the bodies of the start; none: blocks start alone.
inline void set_glued(driftwalk::AssemblyRules& rules, const Cells& cells) {
  if (!cells.has_value()) {
    return;
  }
  const std::size_t count = cells->shape(0);
  if (cells->shape(1) != 2 || count < 1 || count > driftwalk::most_blocks ||
      rules.blocks % static_cast<int>(count) != 0) {
    throw std::invalid_argument("glued must have shape (cells, 2), and divide the blocks");
  }
  rules.glued = static_cast<int>(count);
  rules.glued_cells = cells->data();
}

// Poles of typed faces are signs: like ones repel.
inline void set_faces(driftwalk::AssemblyRules& rules, const driftwalk::FaceRules* faces) {
  rules.faces = faces;
  rules.pull.like_poles_repel = rules.pull.like_poles_repel || faces != nullptr;
}

inline void require_blocks(std::size_t blocks) {
  if (blocks < 1 || blocks > driftwalk::most_blocks) {
    throw std::invalid_argument("a world has 1 to " + std::to_string(driftwalk::most_blocks) +
                                " blocks");
  }
}
