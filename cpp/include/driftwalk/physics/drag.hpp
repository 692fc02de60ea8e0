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

// A face and its sums over the strips so far.
template <class Real>
struct DragFace {
  Real nx, ny;       // normal n; the tangent t is (-ny, nx)
  Real closing;      // -n.w of the next strip in still water [m/s]
  Real past;         // speed of the face along t [m/s]
  Real push;         // sum of f
  Real running;      // M
  Real sum_u, sum_v; // sum of g u, in units of the flow table
  Real sum_g;
};

// Adds the next `count` strips of a face, in a flow (u, v) in units of the flow table.
template <class Real, class T, class Law>
inline void add_strips(const Law& law, T unit, Real spin_step, int count, const Real* u,
                       const Real* v, DragFace<Real>& face) {
  const Real raw_nx = face.nx * unit, raw_ny = face.ny * unit;
  const Real past = face.past;
  // In registers: the compiler cannot know that u and v are not this face.
  Real closing = face.closing, push = face.push, running = face.running;
  Real sum_u = face.sum_u, sum_v = face.sum_v, sum_g = face.sum_g;
  for (int k = 0; k < count; ++k) {
    const Real s = closing - (raw_nx * u[k] + raw_ny * v[k]);
    Real g;
    if constexpr (DragLawBySpeed<Law, Real>) {
      g = law.conductance(s, (raw_nx * v[k] - raw_ny * u[k]) - past);
      push = push + g * s;
    } else {
      g = law.conductance(s);
      push = push + law.force(s);
    }
    running = running + push;
    sum_u = sum_u + g * u[k];
    sum_v = sum_v + g * v[k];
    sum_g = sum_g + g;
    closing = closing - spin_step;
  }
  face = {face.nx, face.ny, closing, past, push, running, sum_u, sum_v, sum_g};
}

// The same for the four faces; not inlined for the registers, as read_rows.
template <class Real, class T, class Law>
[[gnu::noinline]] void add_strips_of_faces(const Law& law, T unit, Real spin_step, int count,
                                           const Real* u, const Real* v, DragFace<Real>* faces) {
  for (int face = 0; face < 4; ++face) {
    const int first = face * most_read_at_once;
    add_strips(law, unit, spin_step, count, u + first, v + first, faces[face]);
  }
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
  const int strips = block.strips;
  const T first_offset = w * T(0.5) - h;
  const Real on_table_x = clamp_to(x, flow.low_x, flow.high_x);
  const Real on_table_y = clamp_to(y, flow.low_y, flow.high_y);
  const Real centre_x = (on_table_x - flow.origin_x) * flow.per_spacing_x;
  const Real centre_y = (on_table_y - flow.origin_y) * flow.per_spacing_y;
  const Real zero{T(0)};
  DragFace<Real> faces[4];
  FlowCursor<Real> rows[4];
  Real nx = axes.cosine, ny = axes.sine;
  for (int face = 0; face < 4; ++face) {
    const Real tx = -ny, ty = nx;
    rows[face] =
        FlowCursor<Real>(flow, centre_x + (nx * h + tx * first_offset) * flow.per_spacing_x,
                         centre_y + (ny * h + ty * first_offset) * flow.per_spacing_y,
                         tx * (w * flow.per_spacing_x), ty * (w * flow.per_spacing_y));
    const Real closing = (nx * motion.vx + ny * motion.vy) - motion.omega * first_offset;
    const Real past = (tx * motion.vx + ty * motion.vy) + motion.omega * h;
    faces[face] = {nx, ny, cover(face, closing), past, zero, zero, zero, zero, zero};
    nx = tx;
    ny = ty;
  }
  for (int first = 0; first < strips; first += most_read_at_once) {
    const int left = strips - first;
    const int count = left < most_read_at_once ? left : most_read_at_once;
    Real u[4 * most_read_at_once], v[4 * most_read_at_once];
    read_rows(rows, 4, count, u, v);
    add_strips_of_faces(law, flow.unit, motion.omega * w, count, u, v, faces);
  }
  DragSums<Real> sums{zero, zero, zero, zero};
  for (const DragFace<Real>& face : faces) {
    const Real tx = -face.ny, ty = face.nx;
    const Real tangential = (tx * face.sum_u + ty * face.sum_v) * flow.unit - face.past * face.sum_g;
    sums.force_x = sums.force_x + (tx * tangential - face.nx * face.push);
    sums.force_y = sums.force_y + (ty * tangential - face.ny * face.push);
    const Real lever = face.push * (T(0.5) * T(strips + 1)) - face.running;
    sums.torque = sums.torque + (tangential * h + lever * w);
    sums.conductance = sums.conductance + face.sum_g;
  }
  return sums;
}

DRIFTWALK_LANES_END
