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

// Half a block's extent along a normal of one of its faces, and half the width of that face.
struct Halves {
  double depth, width;
};
Halves halves_of(const AssemblyRules& rules, Vec2 axis, Vec2 normal) {
  const double length = rules.side / 2, width = width_of(rules) / 2;
  return std::abs(dot(axis, normal)) > std::abs(cross(axis, normal)) ? Halves{length, width}
                                                                     : Halves{width, length};
}

// The corners of the second block's face that looks at the reference face, cut to its width; of
// discs the middle between their centres.
Manifold manifold_of(const AssemblyRules& rules, const Scene& scene, BlockPair pair,
                     const Overlap& overlap) {
  Manifold found{overlap.normal, {}, 0};
  const SceneAssembly& a = assembly_of(scene, pair.first);
  const SceneAssembly& b = assembly_of(scene, pair.second);
  if (rules.round) {
    const Vec2 at = (centre(scene, pair.first) + centre(scene, pair.second)) * 0.5;
    found.touch[found.count++] = {at - Vec2{a.x, a.y}, at - Vec2{b.x, b.y}, overlap.depth};
    return found;
  }
  const int reference = overlap.reference_is_first ? pair.first : pair.second;
  const int incident = overlap.reference_is_first ? pair.second : pair.first;
  const Vec2 out = overlap.normal * (overlap.reference_is_first ? 1.0 : -1.0);
  const Vec2 along{-out.y, out.x};
  const Vec2 own = axis_of(rules, scene, reference), axis = axis_of(rules, scene, incident);
  const Vec2 normals[4] = {axis, {-axis.y, axis.x}, {-axis.x, -axis.y}, {axis.y, -axis.x}};
  Vec2 n = normals[0];
  for (const Vec2& normal : normals) {
    n = dot(normal, out) < dot(n, out) ? normal : n;
  }
  const Vec2 t{-n.y, n.x};
  const Halves half = halves_of(rules, own, out), other = halves_of(rules, axis, n);
  const Vec2 middle = centre(scene, incident) + n * other.depth - centre(scene, reference);
  Vec2 ends[2] = {middle + t * other.width, middle - t * other.width};
  for (Vec2& end : ends) {
    const Vec2& opposite = &end == &ends[0] ? ends[1] : ends[0];
    const double here = dot(end, along), there = dot(opposite, along);
    const double bound = std::clamp(here, -half.width, half.width);
    if (bound != here && here != there) {
      end = end + (opposite - end) * ((bound - here) / (there - here));
    }
  }
  for (const Vec2& end : ends) {
    const double depth = half.depth - dot(end, out);
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

// Rounds in which blocks that overlap are shifted; beyond, they are turned too.
constexpr int shift_rounds = 10;

void shift(Scene& scene, int assembly, Vec2 by, int round) {
  SceneAssembly& a = scene.assembly[assembly];
  a.x += by.x;
  a.y += by.y;
  a.moved = round;
}

// Turns an assembly by a small angle; no library's sine or cosine.
void turn(Scene& scene, int assembly, double angle) {
  constexpr double largest = 0.02, pi = 3.141592653589793;
  angle = std::clamp(angle, -largest, largest);
  SceneAssembly& a = scene.assembly[assembly];
  // Series that end below the rounding of a pose, for an angle this small.
  const double square = angle * angle;
  const double c = 1 - square / 2, s = angle * (1 - square / 6 * (1 - square / 20));
  const double cosine = c * a.cosine - s * a.sine, sine = c * a.sine + s * a.cosine;
  const double length = std::sqrt(cosine * cosine + sine * sine);
  a.cosine = cosine / length;
  a.sine = sine / length;
  a.theta += angle;
  a.theta -= a.theta > pi ? 2 * pi : (a.theta < -pi ? -2 * pi : 0.0);
}

// Moves two blocks apart along the axis of least penetration, in inverse proportion to the masses.
void shift_apart(Scene& scene, BlockPair pair, const Overlap& overlap, int round) {
  const int first = scene.block[pair.first].assembly, second = scene.block[pair.second].assembly;
  const int a = scene.assembly[first].blocks, b = scene.assembly[second].blocks;
  const Vec2 share = overlap.normal * (overlap.depth / (a + b));
  shift(scene, first, share * -b, round);
  shift(scene, second, share * a, round);
}

// The same by impulses of position at the contact points, which turn the assemblies as well: what
// is wedged between others has no other way out.
void turn_apart(const AssemblyRules& rules, Scene& scene, BlockPair pair, const Overlap& overlap,
                int round) {
  const int first = scene.block[pair.first].assembly, second = scene.block[pair.second].assembly;
  SceneAssembly &a = scene.assembly[first], &b = scene.assembly[second];
  const Manifold manifold = manifold_of(rules, scene, pair, overlap);
  const Bodies bodies{a, b, rules.mass * a.blocks, rules.mass * b.blocks};
  for (int k = 0; k < manifold.count; ++k) {
    const Touch& touch = manifold.touch[k];
    const Vec2 n = manifold.normal;
    const double push =
        touch.depth / bodies.response(touch, touch, n) / static_cast<double>(manifold.count);
    shift(scene, first, n * (-push / bodies.mass_first), round);
    shift(scene, second, n * (push / bodies.mass_second), round);
    turn(scene, first, -cross(touch.on_first, n) * push / a.inertia);
    turn(scene, second, cross(touch.on_second, n) * push / b.inertia);
  }
}

// False when it stays outside.
bool keep_inside(const AssemblyRules& rules, Scene& scene, int assembly) {
  constexpr int wall_rounds = 4;
  place_members(scene, assembly);
  return push_inside(rules, scene, assembly, wall_rounds);
}
} // namespace

void bounce(const AssemblyRules& rules, Scene& scene) {
  for (int k = 0; k < scene.close.count; ++k) {
    const BlockPair pair = scene.close.pair[k];
    if (!overlap_by_more(rules, scene, pair.first, pair.second, 0)) {
      continue;
    }
    scene.contact = true;
    const Manifold manifold =
        manifold_of(rules, scene, pair, overlap_of(rules, scene, pair.first, pair.second));
    SceneAssembly &a = assembly_of(scene, pair.first), &b = assembly_of(scene, pair.second);
    Bodies bodies{a, b, rules.mass * a.blocks, rules.mass * b.blocks};
    if (manifold.count > 0) {
      first_pass(rules, bodies, manifold);
      second_pass(rules, bodies, manifold);
    }
    a.touched = b.touched = true;
  }
}

namespace {
// Back to where an assembly was before the step, at rest.
void take_back(Scene& scene, int assembly) {
  SceneAssembly& a = scene.assembly[assembly];
  a.x = a.before.x;
  a.y = a.before.y;
  a.theta = a.before.theta;
  a.cosine = a.before.cosine;
  a.sine = a.before.sine;
  a.vx = a.vy = a.omega = 0;
  a.touched = true;
  place_members(scene, assembly);
}

// What nothing could part or keep inside, assemblies hooked into each other or wedged between walls
// for one, has not moved in this step. Before it all were apart, so in the end they are again.
void undo_jam(const AssemblyRules& rules, Scene& scene) {
  constexpr double tolerance = 1e-4;
  bool jammed = true;
  for (int round = 0; jammed && round < scene.blocks; ++round) {
    jammed = false;
    for (int a = 0; a < scene.blocks; ++a) {
      if (scene.assembly[a].moved > 0 && beyond_wall(rules, scene, a).depth > tolerance) {
        jammed = true;
        take_back(scene, a);
      }
    }
    for (int k = 0; k < scene.pairs.count; ++k) {
      const BlockPair pair = scene.pairs.pair[k];
      if (overlap_by_more(rules, scene, pair.first, pair.second, tolerance)) {
        jammed = true;
        take_back(scene, scene.block[pair.first].assembly);
        take_back(scene, scene.block[pair.second].assembly);
      }
    }
  }
}
} // namespace

void separate(const AssemblyRules& rules, Scene& scene) {
  constexpr int most_rounds = 40;
  constexpr double tolerance = 1e-5;
  for (int a = 0; a < scene.blocks; ++a) {
    scene.assembly[a].moved = 0;
  }
  // What is not close moves when something that is has moved.
  bool moved = false, inside = true;
  for (int k = 0; k < scene.close.count && !moved; ++k) {
    const BlockPair pair = scene.close.pair[k];
    moved = overlap_by_more(rules, scene, pair.first, pair.second, tolerance);
  }
  for (int round = 1; moved && round <= most_rounds; ++round) {
    moved = false;
    for (int k = 0; k < scene.pairs.count; ++k) {
      const BlockPair pair = scene.pairs.pair[k];
      const int first = scene.block[pair.first].assembly,
                second = scene.block[pair.second].assembly;
      // What has not moved since the last round is as it was then.
      if (std::max(scene.assembly[first].moved, scene.assembly[second].moved) < round - 1 ||
          !overlap_by_more(rules, scene, pair.first, pair.second, tolerance)) {
        continue;
      }
      const Overlap overlap = overlap_of(rules, scene, pair.first, pair.second);
      moved = true;
      if (round <= shift_rounds) {
        shift_apart(scene, pair, overlap, round);
      } else {
        turn_apart(rules, scene, pair, overlap, round);
      }
      inside = keep_inside(rules, scene, first) && inside;
      inside = keep_inside(rules, scene, second) && inside;
    }
  }
  if (moved || !inside) {
    // What was moved far may have come near blocks that are not in the list.
    find_pairs(rules, scene);
    scene.rebuilt = true;
    undo_jam(rules, scene);
  }
}

} // namespace driftwalk
