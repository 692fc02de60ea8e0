// A point inside a convex arena: where the wall is, and what it does to who meets it.
#pragma once

#include "driftwalk/math/elementary.hpp"
#include "driftwalk/particle/columns.hpp"
#include "driftwalk/simulate/prepared.hpp"

DRIFTWALK_LANES_BEGIN

// The nearest wall: how far off it is [m], and the outward unit normal there.
template <class Real>
struct NearestWall {
  Real distance, nx, ny;
};

template <class Real, class T>
inline NearestWall<Real> nearest_wall(const WallView<T>& wall, Real clearance, Real x, Real y) {
  if (wall.radius > T(0)) {
    const Real r = sqrt(x * x + y * y);
    const Real per_r = Real(T(1)) / max(r, Real(T(1e-9)));
    return {(Real(wall.radius) - clearance) - r, x * per_r, y * per_r};
  }
  NearestWall<Real> nearest{Real(T(1e30)), Real(T(1)), Real(T(0))};
  for (int e = 0; e < wall.edge_count; ++e) {
    const PreparedEdge<T>& edge = wall.edges[e];
    const Real distance = Real(edge.distance) - clearance - (x * edge.normal_x + y * edge.normal_y);
    const auto nearer = distance < nearest.distance;
    nearest.distance = select(nearer, distance, nearest.distance);
    nearest.nx = select(nearer, Real(edge.normal_x), nearest.nx);
    nearest.ny = select(nearer, Real(edge.normal_y), nearest.ny);
  }
  return nearest;
}

// A direction or velocity that points out of the wall is mirrored at it.
template <class Real>
inline void mirror(const NearestWall<Real>& wall, typename Numbers<Real>::Bool where, Real& vx,
                   Real& vy) {
  using T = typename Numbers<Real>::Scalar;
  const Real out = max(vx * wall.nx + vy * wall.ny, Real(T(0)));
  const Real twice = select(where, out * T(2), Real(T(0)));
  vx = vx - wall.nx * twice;
  vy = vy - wall.ny * twice;
}

// A point is beyond the wall when it is so by this share of the arena's width: contact is rounded.
inline constexpr double contact_slack = 1e-6;

// Brings a point back that is beyond the wall, and calls `touched` with the wall and where that
// was. Between edges that meet at an angle, leaving one can mean entering the next: go round until
// all are clear; in the tip of a sharp corner it goes back to where it came from. A point that is
// thrown back comes in as far as it was out.
template <class Real, class T, class Touched>
inline void stay_inside(const WallView<T>& view, T slack, Real clearance, WallContact contact,
                        Real from_x, Real from_y, Real& x, Real& y, const Touched& touched) {
  constexpr int most_rounds = 16;
  const Real zero{T(0)}, outside{-slack};
  for (int round = 0; round < most_rounds; ++round) {
    const NearestWall<Real> wall = nearest_wall(view, clearance, x, y);
    const auto beyond = wall.distance < outside;
    if (!any(beyond)) {
      return;
    }
    const T back = contact == WallContact::reflect && round == 0 ? T(2) : T(1);
    const Real shift = select(beyond, wall.distance * back, zero);
    x = x + wall.nx * shift;
    y = y + wall.ny * shift;
    touched(wall, beyond);
  }
  const auto stuck = nearest_wall(view, clearance, x, y).distance < outside;
  x = select(stuck, from_x, x);
  y = select(stuck, from_y, y);
}

DRIFTWALK_LANES_END
