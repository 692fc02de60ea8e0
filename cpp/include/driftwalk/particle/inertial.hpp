// A particle whose velocity relaxes to that of the water and is stirred: an Ornstein-Uhlenbeck
// velocity that may turn.
//
//   dw = -w / tau dt + Omega x w dt + s sqrt(2 / tau) dW,   dx = (w + u) dt
//
// The velocity w relative to the water is made exactly over a step; the position takes its mean.
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
        y_(columns.of(worlds.y)), vx_(columns.of(worlds.vx)), vy_(columns.of(worlds.vy)) {
    clearance_ = columns(inertial_clearance);
    const Real kept = kept_over(dt_, columns(inertial_time));
    fresh_ = fresh_with(kept) * columns(inertial_speed_std);
    const Axes<Real> turn = axes_at(columns(inertial_turn_rate) * dt_);
    kept_cosine_ = kept * turn.cosine;
    kept_sine_ = kept * turn.sine;
  }

  void step(const WallView<T>& wall, const FlowView<T>& flow, std::int64_t index) {
    Real normal[4];
    draw_normals(stream_, Purpose::motion, index, normal);
    const Real vx = vx_ * kept_cosine_ - vy_ * kept_sine_ + fresh_ * normal[0];
    const Real vy = vx_ * kept_sine_ + vy_ * kept_cosine_ + fresh_ * normal[1];
    Real u{T(0)}, v{T(0)};
    if (carried_) {
      water_at(flow, x_, y_, u, v);
    }
    x_ = x_ + ((vx_ + vx) * T(0.5) + u) * dt_;
    y_ = y_ + ((vy_ + vy) * T(0.5) + v) * dt_;
    vx_ = vx;
    vy_ = vy;
    stay_inside(wall, clearance_, contact_, x_, y_,
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
  Real ahead_x() const { return vx_; }
  Real ahead_y() const { return vy_; }
  const Philox<typename Numbers<Real>::UInt>& stream() const { return stream_; }

private:
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
  Real x_, y_, vx_, vy_; // the velocity relative to the water
  Real clearance_, fresh_, kept_cosine_, kept_sine_;
};

DRIFTWALK_LANES_END
