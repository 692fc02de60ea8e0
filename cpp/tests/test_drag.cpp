// The flow table at nodes, between them and beyond them, the drag against a plain strip sum, and
// the water's acceleration.
#include "check.hpp"
#include "driftwalk/math/elementary.hpp"
#include "driftwalk/physics/drag.hpp"
#include "driftwalk/physics/laws/mixed.hpp"
#include "driftwalk/physics/water.hpp"
#include "synthetic_tank.hpp"

#include <algorithm>
#include <cmath>

namespace {

using driftwalk::Axes;
using driftwalk::BlockShape;
using driftwalk::DragSums;
using driftwalk::FloatPack;
using driftwalk::FlowCursor;
using driftwalk::Motion;
using Pack = FloatPack<4>;

// A wavy flow without symmetry.
void wavy(double x, double y, double& u, double& v) {
  u = 0.07 * std::sin(31 * x + 5 * y) + 0.02;
  v = 0.05 * std::cos(17 * y - 23 * x);
}

// Bilinear interpolation by definition, on clamped positions.
double bilinear(const synthetic::Tank& tank, const std::vector<double>& values, double x,
                double y) {
  const int last = tank.nodes - 1;
  const double column = std::clamp(x / tank.spacing + last / 2, 0.0, double(last));
  const double row = std::clamp(y / tank.spacing + last / 2, 0.0, double(last));
  const int i = std::min(int(column), last - 1), j = std::min(int(row), last - 1);
  const auto at = [&](int dj, int di) {
    return values[std::size_t((j + dj) * tank.nodes + i + di)];
  };
  const double fx = column - i, fy = row - j;
  return (at(0, 0) * (1 - fx) + at(0, 1) * fx) * (1 - fy) +
         (at(1, 0) * (1 - fx) + at(1, 1) * fx) * fy;
}

template <class T>
double scalar(T value) {
  if constexpr (std::is_same_v<T, double>) {
    return value;
  } else {
    return value[2];
  }
}

template <class Real, class T>
void lookup(const driftwalk::FlowView<T>& flow, double x, double y, double& u, double& v) {
  const Real at_x{static_cast<T>((x - flow.origin_x) * flow.per_spacing_x)};
  const Real at_y{static_cast<T>((y - flow.origin_y) * flow.per_spacing_y)};
  const Real zero{T(0)};
  Real raw_u, raw_v;
  FlowCursor<Real>(flow, at_x, at_y, zero, zero).read(raw_u, raw_v);
  u = scalar(raw_u) * flow.unit;
  v = scalar(raw_v) * flow.unit;
}

template <class Real, class T>
double worst_lookup(const driftwalk::FlowView<T>& flow, const synthetic::Tank& tank, double limit,
                    bool on_nodes) {
  synthetic::Uniform draw;
  double worst = 0;
  for (int k = 0; k < 4000; ++k) {
    double x = limit * draw(), y = limit * draw();
    if (on_nodes) {
      x = std::round(x / tank.spacing) * tank.spacing;
      y = std::round(y / tank.spacing) * tank.spacing;
    }
    double u, v;
    lookup<Real, T>(flow, x, y, u, v);
    worst = std::max({worst, std::fabs(u - bilinear(tank, tank.u, x, y)),
                      std::fabs(v - bilinear(tank, tank.v, x, y))});
  }
  return worst;
}

void check_lookups() {
  synthetic::Tank tank;
  tank.set_flow(wavy);
  tank.sample_every(0.1, 2);
  const driftwalk::PreparedRun<double> twice(tank.finished());
  const driftwalk::PreparedRun<float> single(tank.finished());
  double largest = 0;
  for (std::size_t k = 0; k < tank.u.size(); ++k) {
    largest = std::max({largest, std::fabs(tank.u[k]), std::fabs(tank.v[k])});
  }
  const double quantum = largest / 32767;
  // Nodes are rounded to the nearest quantum, whatever is between them no more than they are.
  CHECK(worst_lookup<double>(twice.view().flow, tank, 0.15, true) <= 0.5001 * quantum);
  CHECK(worst_lookup<double>(twice.view().flow, tank, 0.15, false) <= 0.5001 * quantum);
  const double on_nodes = worst_lookup<Pack>(single.view().flow, tank, 0.15, true);
  const double between = worst_lookup<Pack>(single.view().flow, tank, 0.15, false);
  std::printf("float lookup: %.2f quanta on nodes, %.2f between\n", on_nodes / quantum,
              between / quantum);
  CHECK(on_nodes <= 0.6 * quantum);
  CHECK(between <= quantum);
  // A small grid in the large tank: beyond its edge the edge's value goes on.
  tank.spacing = 0.001;
  tank.set_flow([](double x, double y, double& u, double& v) {
    u = 0.1 * x / 0.031;
    v = 0.1 * y / 0.031;
  });
  const driftwalk::PreparedRun<double> small(tank.finished());
  const driftwalk::PreparedRun<float> small_single(tank.finished());
  CHECK(worst_lookup<double>(small.view().flow, tank, 0.15, false) <= 1e-12);
  CHECK(worst_lookup<Pack>(small_single.view().flow, tank, 0.15, false) <= 0.1 / 32767);
}

// A law of another form than the kernels': F = K max(0, s)^2 w.
struct CubicDrag {
  template <class Real>
  Real conductance(Real closing) const {
    const Real windward = driftwalk::QuadraticDrag{}.conductance(closing);
    return windward * windward;
  }
  template <class Real>
  Real force(Real closing) const {
    return conductance(closing) * closing;
  }
};

// The mixed law of one pair of numbers.
struct SomeMixedDrag {
  static constexpr double quadratic = 0.7, linear = 0.02;

  template <class Real>
  static driftwalk::MixedDrag<Real> law() {
    using T = typename driftwalk::Numbers<Real>::Scalar;
    return {Real(static_cast<T>(quadratic)), Real(static_cast<T>(linear))};
  }
  template <class Real>
  Real conductance(Real closing, Real slip) const {
    return law<Real>().conductance(closing, slip);
  }
};

// The mixed law with another power of the speed for its first part.
struct SomePowerDrag {
  static constexpr double quadratic = 0.7, linear = 0.02, power = 1.4, speed = 0.04;

  template <class Real>
  Real conductance(Real closing, Real slip) const {
    using T = typename driftwalk::Numbers<Real>::Scalar;
    const driftwalk::DragShape<T> shape{static_cast<T>(linear), static_cast<T>(power / 2 - 1),
                                        static_cast<T>(1 / (speed * speed)), false};
    return driftwalk::MixedDrag<Real>::of(Real(static_cast<T>(quadratic)), shape)
        .conductance(closing, slip);
  }
};

double by_definition(SomeMixedDrag, double closing, double) {
  return SomeMixedDrag::quadratic * std::max(0.0, closing) + SomeMixedDrag::linear;
}
double by_definition(SomePowerDrag, double closing, double speed) {
  using L = SomePowerDrag;
  const double bend = closing > 0 ? std::pow(speed / L::speed, L::power - 2) : 0;
  return L::quadratic * std::max(0.0, closing) * bend + L::linear;
}
double by_definition(driftwalk::QuadraticDrag, double closing, double) {
  return std::max(0.0, closing);
}
double by_definition(CubicDrag, double closing, double) {
  return closing > 0 ? closing * closing : 0;
}

struct Sums {
  double force_x = 0, force_y = 0, torque = 0, conductance = 0;
};

// The law strip by strip, every quantity in the frame of the tank.
template <class Law, class Velocity>
Sums strip_sum(double side, int strips, double x, double y, double theta, double vx, double vy,
               double omega, const Velocity& velocity) {
  Sums sums;
  const double half = side / 2, width = side / strips;
  for (int face = 0; face < 4; ++face) {
    const double angle = theta + face * std::acos(-1.0) / 2;
    const double nx = std::cos(angle), ny = std::sin(angle);
    for (int k = 0; k < strips; ++k) {
      const double offset = -half + width * (k + 0.5);
      const double rx = nx * half - ny * offset, ry = ny * half + nx * offset;
      double u, v;
      velocity(x + rx, y + ry, u, v);
      const double wx = u - (vx - omega * ry), wy = v - (vy + omega * rx);
      const double facing = by_definition(Law{}, -(nx * wx + ny * wy), std::hypot(wx, wy));
      sums.force_x += facing * wx;
      sums.force_y += facing * wy;
      sums.torque += rx * (facing * wy) - ry * (facing * wx);
      sums.conductance += facing;
    }
  }
  return sums;
}

template <class Law, class Real, class T, class Velocity>
double worst_drag(synthetic::Tank& tank, const Velocity& velocity) {
  const driftwalk::PreparedRun<T> run(tank.finished());
  const BlockShape<T> block = run.view().block;
  synthetic::Uniform draw;
  double worst = 0;
  for (int k = 0; k < 300; ++k) {
    const double x = 0.13 * draw(), y = 0.13 * draw(), theta = 3.14 * draw();
    const double vx = 0.1 * draw(), vy = 0.1 * draw(), omega = 4 * draw();
    Axes<Real> axes;
    driftwalk::sincos(Real(static_cast<T>(theta)), axes.sine, axes.cosine);
    const DragSums<Real> got = driftwalk::drag_sums(
        Law{}, block, run.view().flow, Real(static_cast<T>(x)), Real(static_cast<T>(y)), axes,
        Motion<Real>{Real(static_cast<T>(vx)), Real(static_cast<T>(vy)),
                     Real(static_cast<T>(omega))});
    const Sums want =
        strip_sum<Law>(tank.model.side, tank.model.strips, x, y, theta, vx, vy, omega, velocity);
    // Relative to N (0.1 m/s)^2 and, for the torque, to that at the half side.
    const double scale = tank.model.strips * 0.01, half = tank.model.side / 2;
    worst = std::max({worst, std::fabs(scalar(got.force_x) - want.force_x) / scale,
                      std::fabs(scalar(got.force_y) - want.force_y) / scale,
                      std::fabs(scalar(got.torque) - want.torque) / scale / half,
                      std::fabs(scalar(got.conductance) - want.conductance) / scale * 0.1});
  }
  return worst;
}

template <class Law, class Velocity>
void check_linear_flow(const char* name, const Velocity& velocity) {
  for (const int strips : {1, 2, 8, 64}) {
    synthetic::Tank tank;
    tank.model.strips = strips;
    tank.set_flow(velocity);
    tank.sample_every(0.1, 2);
    const double twice = worst_drag<Law, double, double>(tank, velocity);
    const double single = worst_drag<Law, Pack, float>(tank, velocity);
    std::printf("%s, %d strips: double %.2g, float %.2g\n", name, strips, twice, single);
    CHECK(twice < 1e-12);
    CHECK(single < 1e-4);
  }
}

template <class Law>
void check_strip_sums() {
  check_linear_flow<Law>("still", [](double, double, double& u, double& v) { u = v = 0; });
  check_linear_flow<Law>("uniform", [](double, double, double& u, double& v) {
    u = 0.1;
    v = -0.1;
  });
  check_linear_flow<Law>("shear", [](double, double y, double& u, double& v) {
    u = 0.31 * y;
    v = 0;
  });
  check_linear_flow<Law>("solid rotation", [](double x, double y, double& u, double& v) {
    u = -0.31 * y;
    v = 0.31 * x;
  });
}

// A block that turns with the water, or drifts with it, feels nothing.
void check_at_rest_in_the_water() {
  synthetic::Tank tank;
  tank.set_flow([](double x, double y, double& u, double& v) {
    u = -0.31 * y;
    v = 0.31 * x;
  });
  tank.sample_every(0.1, 2);
  const driftwalk::PreparedRun<double> run(tank.finished());
  const BlockShape<double> block = run.view().block;
  const Axes<double> axes{0.8, 0.6};
  const DragSums<double> sums =
      driftwalk::drag_sums(driftwalk::QuadraticDrag{}, block, run.view().flow, 0.05, 0.02, axes,
                           Motion<double>{-0.31 * 0.02, 0.31 * 0.05, 0.31});
  CHECK(std::fabs(sums.force_x) < 1e-30 && std::fabs(sums.force_y) < 1e-30);
  CHECK(std::fabs(sums.torque) < 1e-30 && std::fabs(sums.conductance) < 1e-15);
}

// A face that no water reaches feels no law.
void check_covered_faces() {
  const driftwalk::MixedDrag<double> law{0.7, 0.02};
  CHECK(law.conductance(driftwalk::closing_where_covered, 0.0) == 0);
  CHECK(law.conductance(driftwalk::closing_where_covered + 10, 0.0) == 0);
  CHECK(law.conductance(-3.0, 0.0) * -3.0 == -0.06);
}

// Of a flow u = M r that is linear in space Du/Dt = M^2 r, whose mean over a block is that at the
// middle, and half its curl is the same everywhere. Beyond the tank it is that at its edge.
template <class Real, class T>
double worst_water(const driftwalk::PreparedRun<T>& run, double along, double turning) {
  const BlockShape<T> block = run.view().block;
  const double a = along * along - turning * turning, b = 2 * along * turning;
  synthetic::Uniform draw;
  double worst = 0;
  for (int k = 0; k < 300; ++k) {
    const double x = 0.2 * draw(), y = 0.2 * draw();
    const double angle = 3.2 * draw();
    const Axes<Real> axes{Real(static_cast<T>(std::cos(angle))),
                          Real(static_cast<T>(std::sin(angle)))};
    const Motion<Real> got = driftwalk::water_acceleration(
        run.view().water, block, Real(static_cast<T>(x)), Real(static_cast<T>(y)), axes);
    const double px = std::clamp(x, -0.15, 0.15), py = std::clamp(y, -0.15, 0.15);
    worst = std::max({worst, std::fabs(scalar(got.vx) - run.view().water.push * (a * px - b * py)),
                      std::fabs(scalar(got.vy) - run.view().water.push * (b * px + a * py)),
                      0.01 * std::fabs(scalar(got.omega) - run.view().water.spin * b)});
  }
  return worst;
}

void check_water() {
  constexpr double along = -0.4, turning = 1.1;
  synthetic::Tank tank;
  tank.set_flow([](double x, double y, double& u, double& v) {
    u = along * x - turning * y;
    v = turning * x + along * y;
  });
  tank.sample_every(0.1, 2);
  CHECK(driftwalk::PreparedRun<double>(tank.finished()).view().water.count == 0);
  tank.model.added_mass_share = 0.5;
  tank.model.displaced_mass = 2 * tank.model.mass;
  const driftwalk::PreparedRun<double> twice(tank.finished());
  const driftwalk::PreparedRun<float> single(tank.finished());
  CHECK_NEAR(twice.view().water.push, 2.5 / 1.5, 1e-15);
  CHECK_NEAR(twice.view().water.spin, 2.5 / 1.5, 1e-15);
  // Nodes are rounded to a 32,767th of the largest acceleration, 0.6 m/s^2.
  const double worst = worst_water<double>(twice, along, turning);
  const double worst_single = worst_water<Pack>(single, along, turning);
  std::printf("water's acceleration: double %.2g, float %.2g m/s^2\n", worst, worst_single);
  CHECK(worst < 5e-5);
  CHECK(worst_single < 1e-4);
}

} // namespace

int main() {
  check_lookups();
  check_strip_sums<driftwalk::QuadraticDrag>();
  check_strip_sums<CubicDrag>();
  check_strip_sums<SomeMixedDrag>();
  check_strip_sums<SomePowerDrag>();
  check_covered_faces();
  check_water();
  check_at_rest_in_the_water();
  return check::result();
}
