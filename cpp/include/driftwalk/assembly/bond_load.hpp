// How bonds wear in a time step: at a rate, which may grow with the tension that a bridge carries
// in its rigid assembly (docs/explanation/assembly.md#bonds-that-break).
#pragma once

#include "driftwalk/assembly/lane.hpp"

DRIFTWALK_LANES_BEGIN

struct Between {
  double x, y;
};
// From the centre of the first block of a bond to that of the second [m].
template <class Real>
inline Between between_blocks(const PackMemory<Real>& memory, int world, const Bond& bond) {
  const Member<Real>&first = memory.member(bond.first), &second = memory.member(bond.second);
  const int one = memory.lane(bond.first, world), other = memory.lane(bond.second, world);
  return {double(get(second.x, other)) - get(first.x, one),
          double(get(second.y, other)) - get(first.y, one)};
}

// Force on each block over its mass, and torque about the assembly's centre over the same [m/s^2,
// m^2/s^2], of the step that is just over.
struct BlockPush {
  double x, y, torque;
};

template <class Real, class T, class Law>
inline BlockPush push_on(const Physics<Real, T, Law>& physics, int half,
                         const PackMemory<Real>& memory, int block, int world) {
  const Member<Real>& m = memory.member(block);
  const Sums<Real>& sums = memory.sums[&m - memory.members];
  const int lane = memory.lane(block, world);
  // Where the water or other blocks push, the sums are accelerations.
  const bool done = physics.water.count > 0 || physics.pulled;
  const double per_mass = done ? 1.0 : get(physics.world.drag_per_mass, lane);
  const double per_torque = done ? 1.0 / physics.step.per_inertia : per_mass;
  const double noise = get(physics.world.noise_scale, lane);
  const double x = get(m.normals[2 * half], lane) * noise;
  const double y = get(m.normals[2 * half + 1], lane) * noise;
  return {get(sums.part[0], lane) * per_mass + x, get(sums.part[1], lane) * per_mass + y,
          get(sums.part[2], lane) * per_torque + get(m.arm.x, lane) * y - get(m.arm.y, lane) * x};
}

// Tension of a bridge, negative where it is pressed, over the mass of a block [m/s^2]: the force by
// which the side of its second block draws that of its first, so that both go on as one rigid body.
template <class Real, class T, class Law>
inline double tension(const Physics<Real, T, Law>& physics, int half,
                      const PackMemory<Real>& memory, int blocks, int world, const Bond& bond,
                      const std::int32_t* side) {
  const Member<Real>& first = memory.member(bond.first);
  const int at = memory.lane(bond.first, world), root = get(first.root, at);
  BlockPush all{0, 0, 0}, own{0, 0, 0};
  double count = 0, own_count = 0, arm_x = 0, arm_y = 0;
  for (int b = root; b < blocks; ++b) {
    const Member<Real>& m = memory.member(b);
    const int lane = memory.lane(b, world);
    if (get(m.root, lane) != root) {
      continue;
    }
    const BlockPush push = push_on(physics, half, memory, b, world);
    all = {all.x + push.x, all.y + push.y, all.torque + push.torque};
    ++count;
    if (side[b] == 1) {
      own = {own.x + push.x, own.y + push.y, 0};
      ++own_count;
      arm_x += get(m.arm.x, lane);
      arm_y += get(m.arm.y, lane);
    }
  }
  const double spin = get(first.motion.omega, at);
  const double turning = all.torque * get(first.per_inertia, at) / count;
  const double pull_x = own_count * all.x / count - turning * arm_y - spin * spin * arm_x - own.x;
  const double pull_y = own_count * all.y / count + turning * arm_x - spin * spin * arm_y - own.y;
  const Between to_second = between_blocks(memory, world, bond);
  return (pull_x * to_second.x + pull_y * to_second.y) /
         __builtin_sqrt(to_second.x * to_second.x + to_second.y * to_second.y);
}

// Takes the hazard of a step from the bonds of a lane, and forgets what has become clear; returns
// whether a bond has come to its end. `side` is scratch for a number per block.
template <class Real, class T, class Law>
inline bool wear_bonds(const AssemblyRules& rules, const Physics<Real, T, Law>& physics,
                       double block_mass, int half, const PackMemory<Real>& memory, int world,
                       BondList& bonds, std::int32_t* side) {
  const double hazard = rules.bond_rate * physics.step.dt;
  const double clear =
      rules.relatch_clearance * (rules.side > rules.width ? rules.side : rules.width);
  const bool loaded = rules.bond_force > 0 || rules.bond_strength > 0;
  bool over = false;
  bool forgets = false;
  for (int k = 0; k < bonds.count; ++k) {
    Bond& bond = bonds.bond[k];
    if (bond.state == BondState::parted) {
      const Between apart = between_blocks(memory, world, bond);
      if (apart.x * apart.x + apart.y * apart.y >= clear * clear) {
        bond.first = -1; // to be forgotten
        forgets = true;
      }
      continue;
    }
    if (bond.state == BondState::open) {
      continue;
    }
    double worn = hazard;
    // What a loop carries is not determined: its bonds break as without load.
    if (loaded && find_side(bonds, rules.blocks, bond, side)) {
      const double pull =
          block_mass * tension(physics, half, memory, rules.blocks, world, bond, side);
      if (rules.bond_force > 0 && pull > 0 && hazard > 0) {
        worn *= __builtin_exp(pull / rules.bond_force);
      }
      if (rules.bond_strength > 0 && pull > rules.bond_strength) {
        bond.left = 0;
      }
    }
    bond.left -= worn;
    over = over || bond.left <= 0;
  }
  if (forgets) {
    int count = 0;
    for (int k = 0; k < bonds.count; ++k) {
      if (bonds.bond[k].first >= 0) {
        bonds.bond[count++] = bonds.bond[k];
      }
    }
    bonds.count = count;
  }
  return over;
}

DRIFTWALK_LANES_END
