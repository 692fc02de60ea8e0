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

// The sums over all strips, in a flow (u, v) in units of the flow table, face after face. `closing`
// is the closing speed of each face's first strip in still water. Not inlined, because the caller's
// numbers would take registers that the loop needs.
template <class Real, class T, class Law>
[[gnu::noinline]] DragSums<Real> sum_strips(const Law& law, const BlockShape<T>& block, T unit,
                                            const Axes<Real>& axes, const Motion<Real>& motion,
                                            const Real* closing, const Real* u, const Real* v) {
  const T h = block.half_side, w = block.strip_width;
  const int strips = block.strips;
  const Real zero{T(0)};
  const Real spin_step = motion.omega * w;
  DragSums<Real> sums{zero, zero, zero, zero};
  Real nx = axes.cosine, ny = axes.sine;
  for (int face = 0; face < 4; ++face) {
    const Real tx = -ny, ty = nx;
    const Real raw_nx = nx * unit, raw_ny = ny * unit;
    const Real past = (tx * motion.vx + ty * motion.vy) + motion.omega * h; // along the face
    Real closes = closing[face];
    Real push = zero, running = zero, sum_u = zero, sum_v = zero, sum_g = zero;
    for (int k = 0; k < strips; ++k, ++u, ++v) {
      const Real s = closes - (raw_nx * *u + raw_ny * *v);
      Real g;
      if constexpr (DragLawBySpeed<Law, Real>) {
        g = law.conductance(s, (tx * unit * *u + ty * unit * *v) - past);
        push = push + g * s;
      } else {
        g = law.conductance(s);
        push = push + law.force(s);
      }
      running = running + push;
      sum_u = sum_u + g * *u;
      sum_v = sum_v + g * *v;
      sum_g = sum_g + g;
      closes = closes - spin_step;
    }
    const Real tangential = (tx * sum_u + ty * sum_v) * unit - past * sum_g;
    sums.force_x = sums.force_x + (tx * tangential - nx * push);
    sums.force_y = sums.force_y + (ty * tangential - ny * push);
    const Real lever = push * (T(0.5) * T(strips + 1)) - running;
    sums.torque = sums.torque + (tangential * h + lever * w);
    sums.conductance = sums.conductance + sum_g;
    nx = tx;
    ny = ty;
  }
  return sums;
}

// The sums at a place on the table, or at its edge: a NaN or a runaway reads no memory beyond it.
// `cover(face, closing)` may turn the closing speed of a face's first strip into
// closing_where_covered.
template <class Real, class T, DragLaw<Real> Law, class Cover = AllFacesOpen>
inline DragSums<Real> drag_sums(const Law& law, const BlockShape<T>& block, const FlowView<T>& flow,
                                Real x, Real y, const Axes<Real>& axes, const Motion<Real>& motion,
                                const Cover& cover = {}) {
  const T h = block.half_side;
  const T w = block.strip_width;
  const T first_offset = w * T(0.5) - h;
  const Real on_table_x = clamp_to(x, flow.low_x, flow.high_x);
  const Real on_table_y = clamp_to(y, flow.low_y, flow.high_y);
  const Real centre_x = (on_table_x - flow.origin_x) * flow.per_spacing_x;
  const Real centre_y = (on_table_y - flow.origin_y) * flow.per_spacing_y;
  const Real first_turns = motion.omega * first_offset;
  FlowRow<Real> rows[4];
  Real closing[4];
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
    closing[face] = cover(face, ahead - first_turns);
    closing[face + 2] = cover(face + 2, -ahead - first_turns);
    nx = tx;
    ny = ty;
  }
  // Side by side, so that they do not compete for the same places in the cache.
  Real water[2 * 4 * most_strips];
  Real *const u = water, *const v = water + 4 * block.strips;
  read_rows(flow, rows, 4, block.strips, u, v);
  return sum_strips(law, block, flow.unit, axes, motion, closing, u, v);
}

DRIFTWALK_LANES_END
