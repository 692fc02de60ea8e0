// Drag on a square block in a flow, from N vertical strips on each of its four side faces.
//
//     F_k = K g(s_k) w_k,   w_k = u(x_k) - v_k,   s_k = -n.w_k
//
// with the law's conductance g and force f(s) = g(s) s (physics/drag_law.hpp). In the frame of a
// face (normal n, tangent t, strip offsets o_k along t) the sums over it need few operations a
// strip, nine with the quadratic law:
//     n.F = -K sum f,   t.F = K (t.sum(g u) - (t.v + omega h) sum g),
//     torque = h t.F + K sum o_k f_k,   sum o_k f_k = w ((N+1)/2 sum f - M),
// M the sum of the running sums of f, w = a/N, h = a/2.
#pragma once

#include "driftwalk/flow/bilinear.hpp"
#include "driftwalk/physics/body.hpp"
#include "driftwalk/physics/drag_law.hpp"

DRIFTWALK_LANES_BEGIN

// Everything divided by K.
template <class Real>
struct DragSums {
  Real force_x, force_y; // [m^2/s^2]
  Real torque;           // [m^3/s^2]
  Real conductance;      // sum of g over all strips [m/s]: how strongly drag damps motion
};

// Which faces the water does not reach: none of a block alone.
struct AllFacesOpen {
  template <class Real>
  Real operator()(int, Real closing) const {
    return closing;
  }
};

// Sums over the strips of one face: of f, of its running sums, of g u, g v and g.
template <class Real>
struct FaceSums {
  Real push, running, u, v, g;
};

// A face in the water: its outward normal, the closing speed of its first strip in still water, how
// much less each next one closes, and the speed along the face.
template <class Real>
struct FaceMotion {
  Real nx, ny, closing, spin_step, past;

  template <class T>
  FaceMotion(const BlockShape<T>& block, const Motion<Real>& motion, Real normal_x, Real normal_y,
             Real closing_first)
      : nx(normal_x), ny(normal_y), closing(closing_first),
        spin_step(motion.omega * block.strip_width),
        past((-ny * motion.vx + nx * motion.vy) + motion.omega * block.half_side) {}
  FaceMotion() = default;
};

// The flow (u, v) at the strips is in units of the flow table.
template <class Real, class T, class Law>
[[gnu::always_inline]] inline FaceSums<Real> sum_face(const Law& law, int strips, T unit,
                                                      const FaceMotion<Real>& face, const Real* u,
                                                      const Real* v) {
  const Real zero{T(0)};
  const Real tx = -face.ny, ty = face.nx;
  const Real raw_nx = face.nx * unit, raw_ny = face.ny * unit;
  Real closes = face.closing;
  FaceSums<Real> sums{zero, zero, zero, zero, zero};
  for (int k = 0; k < strips; ++k, ++u, ++v) {
    const Real s = closes - (raw_nx * *u + raw_ny * *v);
    Real g;
    if constexpr (DragLawBySpeed<Law, Real>) {
      g = law.conductance(s, (tx * unit * *u + ty * unit * *v) - face.past);
      sums.push = sums.push + g * s;
    } else {
      g = law.conductance(s);
      sums.push = sums.push + law.force(s);
    }
    sums.running = sums.running + sums.push;
    sums.u = sums.u + g * *u;
    sums.v = sums.v + g * *v;
    sums.g = sums.g + g;
    closes = closes - face.spin_step;
  }
  return sums;
}

template <class Real, class T>
[[gnu::always_inline]] inline void add_face(const BlockShape<T>& block, T unit,
                                            const FaceMotion<Real>& face,
                                            const FaceSums<Real>& found, DragSums<Real>& sums) {
  const Real tx = -face.ny, ty = face.nx;
  const Real tangential = (tx * found.u + ty * found.v) * unit - face.past * found.g;
  sums.force_x = sums.force_x + (tx * tangential - face.nx * found.push);
  sums.force_y = sums.force_y + (ty * tangential - face.ny * found.push);
  const Real lever = found.push * (T(0.5) * T(block.strips + 1)) - found.running;
  sums.torque = sums.torque + (tangential * block.half_side + lever * block.strip_width);
  sums.conductance = sums.conductance + found.g;
}

// The sums over all strips, face after face. `closing` is the closing speed of each face's first
// strip in still water. Not inlined, because the caller's numbers would take registers that the
// loop needs.
template <class Real, class T, class Law>
[[gnu::noinline]] DragSums<Real> sum_strips(const Law& law, const BlockShape<T>& block, T unit,
                                            const Axes<Real>& axes, const Motion<Real>& motion,
                                            const Real* closing, const Real* u, const Real* v) {
  const Real zero{T(0)};
  DragSums<Real> sums{zero, zero, zero, zero};
  Real nx = axes.cosine, ny = axes.sine;
  for (int face = 0; face < 4; ++face, u += block.strips, v += block.strips) {
    const FaceMotion<Real> moving(block, motion, nx, ny, closing[face]);
    add_face(block, unit, moving, sum_face(law, block.strips, unit, moving, u, v), sums);
    const Real tx = -ny;
    ny = nx;
    nx = tx;
  }
  return sums;
}

// The rows of strips of the four faces and the closing speed of the first of each, at a place on
// the table, or at its edge: a NaN or a runaway reads no memory beyond it.
template <class Real, class T>
[[gnu::always_inline]] inline void
find_faces(const BlockShape<T>& block, const FlowView<T>& flow, Real x, Real y,
           const Axes<Real>& axes, const Motion<Real>& motion, FlowRow<Real>* rows, Real* closing) {
  const T h = block.half_side;
  const T w = block.strip_width;
  const T first_offset = w * T(0.5) - h;
  const Real on_table_x = clamp_to(x, flow.low_x, flow.high_x);
  const Real on_table_y = clamp_to(y, flow.low_y, flow.high_y);
  const Real centre_x = (on_table_x - flow.origin_x) * flow.per_spacing_x;
  const Real centre_y = (on_table_y - flow.origin_y) * flow.per_spacing_y;
  const Real first_turns = motion.omega * first_offset;
  Real nx = axes.cosine, ny = axes.sine;
  // Two neighbouring faces; those opposite are their mirror images.
  for (int face = 0; face < 2; ++face) {
    const Real tx = -ny, ty = nx;
    const Real out_x = (nx * h + tx * first_offset) * flow.per_spacing_x;
    const Real out_y = (ny * h + ty * first_offset) * flow.per_spacing_y;
    rows[face] = FlowRow<Real>(centre_x + out_x, centre_y + out_y, tx * (w * flow.per_spacing_x),
                               ty * (w * flow.per_spacing_y));
    rows[face + 2] = rows[face].backwards_from(centre_x - out_x, centre_y - out_y);
    const Real ahead = nx * motion.vx + ny * motion.vy;
    closing[face] = ahead - first_turns;
    closing[face + 2] = -ahead - first_turns;
    nx = tx;
    ny = ty;
  }
}

// The sums at a place. `cover(face, closing)` may turn the closing speed of a face's first strip
// into closing_where_covered.
template <class Real, class T, DragLaw<Real> Law, class Cover = AllFacesOpen>
inline DragSums<Real> drag_sums(const Law& law, const BlockShape<T>& block, const FlowView<T>& flow,
                                Real x, Real y, const Axes<Real>& axes, const Motion<Real>& motion,
                                const Cover& cover = {}) {
  FlowRow<Real> rows[4];
  Real closing[4];
  find_faces(block, flow, x, y, axes, motion, rows, closing);
  for (int face = 0; face < 4; ++face) {
    closing[face] = cover(face, closing[face]);
  }
  // Side by side, so that they do not compete for the same places in the cache.
  Real water[2 * 4 * most_strips];
  Real *const u = water, *const v = water + 4 * block.strips;
  read_rows(flow, rows, 4, block.strips, u, v);
  return sum_strips(law, block, flow.unit, axes, motion, closing, u, v);
}

DRIFTWALK_LANES_END
