// Bonds that break in scenes put together by hand: what parts keeps momentum, angular momentum and
// energy, summed block by block; loops are cut where two of their bonds are broken.
#include "check.hpp"
#include "hand_scene.hpp"

#include <array>
#include <cmath>
#include <vector>

namespace {

using driftwalk::Bond;
using driftwalk::BondState;
using driftwalk::EventKind;
using synthetic::Cells;
using synthetic::HandScene;
using synthetic::Momentum;
using synthetic::Place;
using synthetic::Uniform;

// A scene of one assembly whose neighbours are bonded.
struct Bonded {
  HandScene hand;
  std::vector<Bond> bonds;
  std::vector<std::int32_t> kinds;
  std::vector<int> blocks;

  Bonded(const driftwalk::AssemblyRules& rules, const Cells& cells, Uniform& draw)
      : hand(rules), bonds(std::size_t(driftwalk::bond_room(rules.blocks))),
        kinds(std::size_t(rules.blocks), -1) {
    for (int k = 0; k < rules.blocks; ++k) {
      blocks.push_back(k);
    }
    hand.scene.bonds = {bonds.data(), 0, int(bonds.size())};
    hand.scene.event_kind = kinds.data();
    hand.scene.key = 12345;
    hand.add(blocks, cells, 0.3 * draw(), 0.3 * draw(), squares::pi * draw(), 0.1 * draw(),
             0.1 * draw(), 3 * draw());
    driftwalk::bond_all(rules, hand.scene);
    hand.scene.event_count = 0;
  }
  void end(int k) {
    bonds[std::size_t(k)].left = 0;
    driftwalk::break_bonds(hand.rules, hand.scene);
  }
};

driftwalk::AssemblyRules breaking(const Place& place) {
  driftwalk::AssemblyRules rules = place.rules;
  rules.bonds_break = true;
  rules.bond_rate = 1;
  return rules;
}

void a_parting_keeps_momentum_and_energy() {
  const Cells shapes[] = {
      {{0, 0}, {1, 0}}, {{0, 0}, {1, 0}, {2, 0}, {1, 1}}, {{0, 0}, {0, 1}, {0, 2}, {1, 2}, {2, 2}}};
  Uniform draw;
  for (const Cells& cells : shapes) {
    const Place place(Place::wide(), int(cells.size()));
    const driftwalk::AssemblyRules rules = breaking(place);
    for (int k = 0; k + 1 < int(cells.size()); ++k) {
      Bonded made(rules, cells, draw);
      CHECK(made.hand.scene.bonds.count == int(cells.size()) - 1);
      const Momentum before = momentum(made.hand, made.blocks);
      made.end(k);
      const Momentum after = momentum(made.hand, made.blocks);
      CHECK(made.hand.scene.assemblies == 2 && made.hand.scene.event_count == 1);
      CHECK(made.kinds[0] == int(EventKind::parting));
      CHECK(std::fabs(after.x - before.x) < 1e-17 && std::fabs(after.y - before.y) < 1e-17);
      CHECK(std::fabs(after.spin - before.spin) < 1e-17);
      CHECK(std::fabs(after.energy - before.energy) < 1e-17);
      // Nothing has moved, and the parts bar each other.
      CHECK(std::fabs(after.middle_x - before.middle_x) < 1e-15);
      const Bond& bond = made.bonds[std::size_t(k)];
      CHECK(bond.state == BondState::parted);
      CHECK(driftwalk::are_unclear(made.hand.scene,
                                   made.hand.block[std::size_t(bond.first)].assembly,
                                   made.hand.block[std::size_t(bond.second)].assembly));
    }
  }
}

void a_loop_is_cut_where_two_bonds_are_broken() {
  const Cells ring = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  const Place place(Place::wide(), 4);
  const driftwalk::AssemblyRules rules = breaking(place);
  Uniform draw;
  for (int first = 0; first < 4; ++first) {
    for (int second = 0; second < 4; ++second) {
      if (first == second) {
        continue;
      }
      Bonded made(rules, ring, draw);
      CHECK(made.hand.scene.bonds.count == 4);
      made.end(first);
      CHECK(made.hand.scene.assemblies == 1 && made.kinds[0] == int(EventKind::opening));
      made.end(second);
      CHECK(made.hand.scene.assemblies == 2 && made.kinds[1] == int(EventKind::parting));
      int parted = 0;
      for (const Bond& bond : made.bonds) {
        parted += bond.state == BondState::parted && bond.second > 0;
      }
      CHECK(parted == 2);
    }
  }
}

void every_bond_has_a_hazard_of_its_own() {
  const Place place(Place::wide(), 4);
  const driftwalk::AssemblyRules rules = breaking(place);
  Uniform draw;
  Bonded one(rules, {{0, 0}, {1, 0}, {1, 1}, {0, 1}}, draw);
  Bonded two(rules, {{0, 0}, {1, 0}, {1, 1}, {0, 1}}, draw);
  for (std::size_t k = 0; k < 4; ++k) {
    CHECK(one.bonds[k].left > 0 && one.bonds[k].left == two.bonds[k].left);
    CHECK(k == 0 || one.bonds[k].left != one.bonds[k - 1].left);
  }
}

void blocks_that_go_take_their_own_bonds_alone() {
  // A square of four with an open bond, without its last block: the other bonds are as they were.
  const Place place(Place::wide(), 4);
  const driftwalk::AssemblyRules rules = breaking(place);
  Uniform draw;
  Bonded made(rules, {{0, 0}, {1, 0}, {1, 1}, {0, 1}}, draw);
  made.end(0);
  const std::vector<Bond> before = made.bonds;
  driftwalk::keep_first_blocks(rules, made.hand.scene, 3);
  driftwalk::drop_bonds(made.hand.scene, made.hand.scene.bonds);
  int kept = 0;
  for (const Bond& bond : before) {
    if (bond.second > 0 && bond.second < 3) {
      const Bond& now = made.bonds[std::size_t(kept++)];
      CHECK(now.first == bond.first && now.second == bond.second);
      CHECK(now.state == bond.state && now.left == bond.left);
    }
  }
  CHECK(kept == 2 && made.hand.scene.bonds.count == kept);
}

} // namespace

int main() {
  blocks_that_go_take_their_own_bonds_alone();
  a_parting_keeps_momentum_and_energy();
  a_loop_is_cut_where_two_bonds_are_broken();
  every_bond_has_a_hazard_of_its_own();
  return check::result();
}
