// Contacts between the blocks of different assemblies: impulses, then positions.
//
// As at the wall: the normal impulses of both contact points are solved together, with restitution
// above the bounce speed; friction follows, then a pass without restitution. Every impulse reflects
// a closing speed with e <= 1 or opposes a sliding one, so the energy never grows.
#include "driftwalk/assembly/settle_parts.hpp"

#include <algorithm>
#include <cmath>

namespace driftwalk {

namespace {
struct Touch {
  Vec2 on_first, on_second; // contact point from the centres of mass [m]
  double depth;
};
struct Manifold {
  Vec2 normal; // from the first block to the second
  Touch touch[2];
  int count;
};

// The corners of the second square's face that looks at the reference face, cut to its width.
Manifold manifold_of(const AssemblyRules& rules, const Scene& scene, BlockPair pair,
                     const Overlap& overlap) {
  const double half_side = rules.side / 2;
  Manifold found{overlap.normal, {}, 0};
  const int reference = overlap.reference_is_first ? pair.first : pair.second;
  const int incident = overlap.reference_is_first ? pair.second : pair.first;
  const Vec2 out = overlap.normal * (overlap.reference_is_first ? 1.0 : -1.0);
  const Vec2 along{-out.y, out.x};
  const SceneAssembly& other = assembly_of(scene, incident);
  int facing = 0;
  for (int face = 1; face < 4; ++face) {
    if (dot(face_normal(other, face), out) < dot(face_normal(other, facing), out)) {
      facing = face;
    }
  }
  const Vec2 n = face_normal(other, facing), t{-n.y, n.x};
  const Vec2 middle = centre(scene, incident) + n * half_side - centre(scene, reference);
  Vec2 ends[2] = {middle + t * half_side, middle - t * half_side};
  for (Vec2& end : ends) {
    const Vec2& opposite = &end == &ends[0] ? ends[1] : ends[0];
    const double here = dot(end, along), there = dot(opposite, along);
    const double bound = std::clamp(here, -half_side, half_side);
    if (bound != here && here != there) {
      end = end + (opposite - end) * ((bound - here) / (there - here));
    }
  }
  const SceneAssembly& a = assembly_of(scene, pair.first);
  const SceneAssembly& b = assembly_of(scene, pair.second);
  for (const Vec2& end : ends) {
    const double depth = half_side - dot(end, out);
    if (depth > 0) {
      const Vec2 at = end + centre(scene, reference);
      found.touch[found.count++] = {at - Vec2{a.x, a.y}, at - Vec2{b.x, b.y}, depth};
    }
  }
  return found;
}

// The two bodies of a contact; impulses act on the second along an axis, on the first against it.
struct Bodies {
  SceneAssembly &first, &second;
  double mass_first, mass_second;

  double speed(const Touch& touch, Vec2 axis) const {
    const Vec2 a{first.vx - first.omega * touch.on_first.y,
                 first.vy + first.omega * touch.on_first.x};
    const Vec2 b{second.vx - second.omega * touch.on_second.y,
                 second.vy + second.omega * touch.on_second.x};
    return dot(a - b, axis);
  }
  // How much a unit impulse at `cause` changes the speed at `effect`, along an axis.
  double response(const Touch& effect, const Touch& cause, Vec2 axis) const {
    return 1 / mass_first + 1 / mass_second +
           cross(effect.on_first, axis) * cross(cause.on_first, axis) / first.inertia +
           cross(effect.on_second, axis) * cross(cause.on_second, axis) / second.inertia;
  }
  void push(const Touch& touch, Vec2 axis, double impulse) {
    first.vx -= axis.x * impulse / mass_first;
    first.vy -= axis.y * impulse / mass_first;
    first.omega -= cross(touch.on_first, axis) * impulse / first.inertia;
    second.vx += axis.x * impulse / mass_second;
    second.vy += axis.y * impulse / mass_second;
    second.omega += cross(touch.on_second, axis) * impulse / second.inertia;
  }
};

// Coulomb friction that belongs to a normal impulse.
void rub(const AssemblyRules& rules, Bodies& bodies, const Touch& touch, Vec2 normal,
         double impulse) {
  const Vec2 along{-normal.y, normal.x};
  const double stop = bodies.speed(touch, along) / bodies.response(touch, touch, along);
  const double limit = impulse * rules.friction;
  bodies.push(touch, along, std::clamp(stop, -limit, limit));
}

// Speed to be taken from a contact point that closes: with restitution, it comes back.
double wanted(const AssemblyRules& rules, double closing) {
  return closing > 0 ? closing * (1 + (closing > rules.bounce_speed ? rules.restitution : 0.0)) : 0;
}

void first_pass(const AssemblyRules& rules, Bodies& bodies, const Manifold& m) {
  double push[2] = {0, 0}, want[2] = {0, 0};
  for (int k = 0; k < m.count; ++k) {
    want[k] = wanted(rules, bodies.speed(m.touch[k], m.normal));
  }
  const Touch &a = m.touch[0], &b = m.touch[m.count - 1];
  const double aa = bodies.response(a, a, m.normal);
  const double bb = bodies.response(b, b, m.normal);
  const double ab = bodies.response(a, b, m.normal);
  const double determinant = aa * bb - ab * ab;
  const double joint_a = bb * want[0] - ab * want[1], joint_b = aa * want[1] - ab * want[0];
  if (m.count == 2 && want[0] > 0 && want[1] > 0 && joint_a > 0 && joint_b > 0 && determinant > 0) {
    push[0] = joint_a / determinant;
    push[1] = joint_b / determinant;
  } else if (m.count == 1 || want[0] * bb >= want[1] * aa) {
    push[0] = want[0] / aa;
  } else {
    push[1] = want[1] / bb;
  }
  for (int k = 0; k < m.count; ++k) {
    bodies.push(m.touch[k], m.normal, push[k]);
  }
  for (int k = 0; k < m.count; ++k) {
    rub(rules, bodies, m.touch[k], m.normal, push[k]);
  }
}

// What the first pass left closing is stopped, without restitution.
void second_pass(const AssemblyRules& rules, Bodies& bodies, const Manifold& m) {
  for (int k = 0; k < m.count; ++k) {
    const double closing = bodies.speed(m.touch[k], m.normal);
    if (closing > 0) {
      const double push = closing / bodies.response(m.touch[k], m.touch[k], m.normal);
      bodies.push(m.touch[k], m.normal, push);
      rub(rules, bodies, m.touch[k], m.normal, push);
    }
  }
}

bool may_touch(const AssemblyRules& rules, const Scene& scene, BlockPair pair) {
  return scene.block[pair.first].assembly != scene.block[pair.second].assembly &&
         !are_far(rules, scene, pair.first, pair.second);
}

void shift(const AssemblyRules& rules, Scene& scene, int assembly, Vec2 by, int round) {
  constexpr int wall_rounds = 4;
  SceneAssembly& a = scene.assembly[assembly];
  a.x += by.x;
  a.y += by.y;
  a.moved = round;
  place_members(scene, assembly);
  push_inside(rules, scene, assembly, wall_rounds);
}
} // namespace

void bounce(const AssemblyRules& rules, Scene& scene) {
  for (int k = 0; k < scene.pairs.count; ++k) {
    const BlockPair pair = scene.pairs.pair[k];
    if (!may_touch(rules, scene, pair)) {
      continue;
    }
    const Overlap overlap = overlap_of(rules, scene, pair.first, pair.second);
    if (!(overlap.depth > 0)) {
      continue;
    }
    scene.contact = true;
    const Manifold manifold = manifold_of(rules, scene, pair, overlap);
    SceneAssembly &a = assembly_of(scene, pair.first), &b = assembly_of(scene, pair.second);
    Bodies bodies{a, b, rules.mass * a.blocks, rules.mass * b.blocks};
    if (manifold.count > 0) {
      first_pass(rules, bodies, manifold);
      second_pass(rules, bodies, manifold);
    }
    a.touched = b.touched = true;
  }
}

void separate(const AssemblyRules& rules, Scene& scene) {
  constexpr int most_rounds = 100;
  constexpr double tolerance = 1e-5;
  for (int a = 0; a < scene.blocks; ++a) {
    scene.assembly[a].moved = 0;
  }
  bool moved = true;
  for (int round = 1; moved && round <= most_rounds; ++round) {
    moved = false;
    for (int k = 0; k < scene.pairs.count; ++k) {
      const BlockPair pair = scene.pairs.pair[k];
      const int first = scene.block[pair.first].assembly,
                second = scene.block[pair.second].assembly;
      SceneAssembly &a = scene.assembly[first], &b = scene.assembly[second];
      // What has not moved since the last round is as it was then.
      if (std::max(a.moved, b.moved) < round - 1 || !may_touch(rules, scene, pair)) {
        continue;
      }
      const Overlap overlap = overlap_of(rules, scene, pair.first, pair.second);
      if (!(overlap.depth > tolerance)) {
        continue;
      }
      moved = true;
      const Vec2 share = overlap.normal * (overlap.depth / (a.blocks + b.blocks));
      shift(rules, scene, first, share * -b.blocks, round);
      shift(rules, scene, second, share * a.blocks, round);
    }
  }
}

} // namespace driftwalk
