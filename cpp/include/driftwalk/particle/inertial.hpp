// A particle whose velocity relaxes to that of the water and is stirred: an Ornstein-Uhlenbeck
// velocity that may turn.
//
//   dw = -w / tau dt + Omega x w dt + s sqrt(2 / tau) dW,   dx = (w + u) dt
//
// The velocity w relative to the water is made exactly over a step. The position takes the mean of
// its ends, times what makes the diffusion over long times, s^2 tau, exact.
#pragma once

#include "driftwalk/particle/enclosure.hpp"
#include "driftwalk/particle/switching.hpp"

DRIFTWALK_LANES_BEGIN

template <class Real>
class InertialParticle {
public:
  using T = typename Numbers<Real>::Scalar;
  using Bool = typename Numbers<Real>::Bool;

  InertialParticle(const ColumnReader<Real>& columns, const BatchWorlds& worlds, double step)
      : stream_(columns.stream()), contact_(worlds.particle.contact),
        carried_(worlds.particle.carried), dt_(static_cast<T>(step)), x_(columns.of(worlds.x)),
        y_(columns.of(worlds.y)), vx_(columns.of(worlds.vx)), vy_(columns.of(worlds.vy)),
        before_x_(vx_), before_y_(vy_) {
    clearance_ = columns(inertial_clearance);
    const Real memory = columns(inertial_time);
    const Real kept = kept_over(dt_, memory);
    way_ = Real(dt_) * trapezoid_correction(Real(dt_) / max(memory, Real(T(1e-9))), kept);
    fresh_ = fresh_with(kept) * columns(inertial_speed_std);
    const Axes<Real> turn = axes_at(columns(inertial_turn_rate) * dt_);
    kept_cosine_ = kept * turn.cosine;
    kept_sine_ = kept * turn.sine;
  }

  void step(const WallView<T>& wall, const FlowView<T>& flow, std::int64_t index) {
    Real normal[4];
    draw_normals(stream_, Purpose::motion, index, normal);
    const T slack = (flow.high_x - flow.low_x) * static_cast<T>(contact_slack);
    const Real vx = vx_ * kept_cosine_ - vy_ * kept_sine_ + fresh_ * normal[0];
    const Real vy = vx_ * kept_sine_ + vy_ * kept_cosine_ + fresh_ * normal[1];
    Real u{T(0)}, v{T(0)};
    if (carried_) {
      water_at(flow, x_, y_, u, v);
    }
    const Real from_x = x_, from_y = y_;
    x_ = x_ + (vx_ + vx) * T(0.5) * way_ + u * dt_;
    y_ = y_ + (vy_ + vy) * T(0.5) * way_ + v * dt_;
    before_x_ = vx_;
    before_y_ = vy_;
    vx_ = vx;
    vy_ = vy;
    stay_inside(wall, slack, clearance_, contact_, from_x, from_y, x_, y_,
                [&](const NearestWall<Real>& nearest, Bool touched) {
                  if (contact_ == WallContact::reflect) {
                    mirror(nearest, touched, vx_, vy_);
                  } else {
                    stop_at(nearest, touched);
                  }
                });
  }

  Real x() const { return x_; }
  Real y() const { return y_; }
  // The velocity at a share of the last step.
  Real ahead_x(T share) const { return before_x_ + (vx_ - before_x_) * share; }
  Real ahead_y(T share) const { return before_y_ + (vy_ - before_y_) * share; }
  const Philox<typename Numbers<Real>::UInt>& stream() const { return stream_; }

private:
  // The square root of tanh(z / 2) / (z / 2): a sum of means of ends diffuses too far by its
  // inverse square.
  static Real trapezoid_correction(Real z, Real kept) {
    const Real one{T(1)}, half = z * T(0.5);
    const Real ratio = (one - kept) / ((one + kept) * half);
    const Real small = one - half * half * T(1.0 / 3.0);
    return sqrt(select(z < Real(T(0.02)), small, ratio));
  }

  void stop_at(const NearestWall<Real>& wall, Bool touched) {
    const Real out = max(vx_ * wall.nx + vy_ * wall.ny, Real(T(0)));
    const Real lost = select(touched, out, Real(T(0)));
    vx_ = vx_ - wall.nx * lost;
    vy_ = vy_ - wall.ny * lost;
  }

  Philox<typename Numbers<Real>::UInt> stream_;
  WallContact contact_;
  bool carried_;
  T dt_;
  Real x_, y_, vx_, vy_;     // the velocity relative to the water
  Real before_x_, before_y_; // the same when the last step began
  Real clearance_, way_, fresh_, kept_cosine_, kept_sine_;
};

DRIFTWALK_LANES_END
