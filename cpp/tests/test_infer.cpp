// The innovations filter: the normal law, the spline flow by definition, edges of the grid, and
// that a run writes all that it hands out.
#include "check.hpp"
#include "driftwalk/infer/expected_drag.hpp"
#include "driftwalk/infer/innovations.hpp"
#include "driftwalk/infer/kalman.hpp"
#include "driftwalk/physics/laws/quadratic.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using driftwalk::Angle;
using driftwalk::DragModel;
using driftwalk::Eight;
using driftwalk::InnovationsFilter;

const double missing = std::numeric_limits<double>::quiet_NaN();

// --- the normal law
// -------------------------------------------------------------------------------
void check_normal_law() {
  double density = 0, tail = 0, mills = 0;
  for (int k = -8000; k < 8000; k += 8) {
    double z[8];
    for (int lane = 0; lane < 8; ++lane) {
      z[lane] = (k + lane + 0.5) / 1000;
    }
    const driftwalk::NormalLaw law = driftwalk::normal_law(Eight::load(z));
    for (int lane = 0; lane < 8; ++lane) {
      const double wanted = std::exp(-0.5 * z[lane] * z[lane]) / std::sqrt(2 * std::acos(-1.0));
      const double below = 0.5 * std::erfc(-z[lane] / std::sqrt(2.0));
      density = std::max(density, std::fabs(law.density[lane] / wanted - 1));
      tail = std::max(tail, std::fabs(law.probability[lane] / below - 1));
      if (z[lane] > 0) {
        const double above = 0.5 * std::erfc(z[lane] / std::sqrt(2.0));
        mills = std::max(mills,
                         std::fabs(driftwalk::mills_ratio(Eight(z[lane]))[0] * wanted / above - 1));
      }
    }
  }
  std::printf("normal law: density %.1e, probability %.1e, Mills' ratio %.1e (relative)\n", density,
              tail, mills);
  CHECK(density < 2e-15);
  CHECK(tail < 2e-14);
  CHECK(mills < 2e-14);
  // Beyond the reach; the other lanes are not disturbed.
  const double far[8] = {-1e300, 1e300, -9, 9, -8.5, 8.5, 0, missing};
  const driftwalk::NormalLaw law = driftwalk::normal_law(Eight::load(far));
  for (int lane = 0; lane < 6; ++lane) {
    CHECK(law.density[lane] == 0 && law.probability[lane] == lane % 2);
  }
  CHECK_NEAR(law.probability[6], 0.5, 1e-15);
}

// --- the law's moments
// ---------------------------------------------------------------------------
// The mean of h(s, E[w_t | s]) over s > 0, by Simpson's rule: h is at most linear in w_t.
template <class Function>
double windward_mean(double mean, double slip, double variance, double cross, const Function& h) {
  constexpr int parts = 4000;
  const double tau = std::sqrt(variance);
  const double from = std::max(0.0, mean - 9 * tau), to = mean + 9 * tau;
  double sum = 0;
  for (int k = 0; k <= parts && to > from; ++k) {
    const double s = from + (to - from) * k / parts, z = (s - mean) / tau;
    const double weight = k == 0 || k == parts ? 1 : (k % 2 == 1 ? 4 : 2);
    sum += weight * h(s, slip + cross * z / tau) * std::exp(-0.5 * z * z);
  }
  return sum * (to - from) / (3 * parts) / (tau * std::sqrt(2 * std::acos(-1.0)));
}

void check_quadratic_moments() {
  double worst = 0;
  for (const double mean : {-0.02, -0.004, 0.0, 0.003, 0.05}) {
    for (const double cross : {-3e-5, 0.0, 2e-5}) {
      const double slip = 0.02, variance = 1e-4, tau = 0.01;
      const driftwalk::StripMoments m = driftwalk::QuadraticDrag{}.moments(
          Eight(mean), Eight(slip), Eight(variance), Eight(cross));
      const auto differs = [&](Eight got, double unit, const auto& h) {
        const double want = windward_mean(mean, slip, variance, cross, h);
        worst = std::max(worst, std::fabs(got[0] - want) / unit);
      };
      differs(m.conductance, tau, [](double s, double) { return s; });
      differs(m.force, tau * tau, [](double s, double) { return s * s; });
      differs(m.slip_force, tau * tau, [](double s, double w) { return s * w; });
      differs(m.slope, 1, [](double, double) { return 1; });
      differs(m.slope_force, tau, [](double s, double) { return s; });
      differs(m.slope_slip, tau, [](double, double w) { return w; });
      differs(m.bend_force, 1, [](double, double) { return 2; });
      // g'' is a unit step of the slope at s = 0: the density there, times the slip there.
      const double z = mean / tau;
      const double at_edge = std::exp(-0.5 * z * z) / (tau * std::sqrt(2 * std::acos(-1.0)));
      worst = std::max(worst, std::fabs(m.bend_slip[0] - at_edge * (slip - cross * z / tau)));
    }
  }
  std::printf("moments of the quadratic law: %.1e\n", worst);
  CHECK(worst < 1e-11);
}

// --- the flow
// ------------------------------------------------------------------------------------- Cubic
// B-spline with knots 0, 1, 2, 3, 4 by the recursion of de Boor.
double b_spline(double t, int degree = 3, int first = 0) {
  if (degree == 0) {
    return first <= t && t < first + 1 ? 1 : 0;
  }
  return (t - first) / degree * b_spline(t, degree - 1, first) +
         (first + degree + 1 - t) / degree * b_spline(t, degree - 1, first + 1);
}

struct Flow {
  driftwalk::SplineView view{nullptr, -0.07, -0.05, 0.02, 11, 9};
  std::vector<double> coefficients, nodes;

  Flow() {
    std::mt19937 random(5);
    std::normal_distribution<double> draw(0, 0.05);
    const std::size_t n = std::size_t(view.columns) * std::size_t(view.rows);
    coefficients.resize(2 * n);
    nodes.resize(2 * n);
    for (std::size_t k = 0; k < n; ++k) {
      nodes[2 * k] = coefficients[k] = draw(random);
      nodes[2 * k + 1] = coefficients[n + k] = draw(random);
    }
    view.nodes = nodes.data();
  }
  // By definition, over all nodes: component 0 is u, 1 is v.
  double at(int component, double x, double y) const {
    double sum = 0;
    for (int j = 0; j < view.rows; ++j) {
      for (int i = 0; i < view.columns; ++i) {
        const double c = nodes[2 * (std::size_t(j) * std::size_t(view.columns) + std::size_t(i)) +
                               std::size_t(component)];
        sum += c * b_spline((x - view.origin_x) / view.spacing - i + 3) *
               b_spline((y - view.origin_y) / view.spacing - j + 3);
      }
    }
    return sum;
  }
};

void check_flow() {
  const Flow flow;
  std::mt19937 random(6);
  std::uniform_real_distribution<double> in_x(-0.0699, 0.0899), in_y(-0.0499, 0.0699);
  double worst = 0, worst_slope = 0;
  for (int k = 0; k < 200; ++k) {
    double x[8], y[8];
    for (int lane = 0; lane < 8; ++lane) {
      x[lane] = in_x(random);
      y[lane] = in_y(random);
    }
    x[0] = flow.view.origin_x + flow.view.spacing * (k % 8); // on the edge of a cell
    driftwalk::StripsOnGrid grid;
    const driftwalk::FlowAtStrips at =
        driftwalk::flow_at_strips(flow.view, Eight::load(x), Eight::load(y), grid);
    const double h = 1e-6;
    for (int lane = 0; lane < 8; ++lane) {
      const auto by_x = [&](int c) {
        return (flow.at(c, x[lane] + h, y[lane]) - flow.at(c, x[lane] - h, y[lane])) / (2 * h);
      };
      const auto by_y = [&](int c) {
        return (flow.at(c, x[lane], y[lane] + h) - flow.at(c, x[lane], y[lane] - h)) / (2 * h);
      };
      worst = std::max({worst, std::fabs(at.u[lane] - flow.at(0, x[lane], y[lane])),
                        std::fabs(at.v[lane] - flow.at(1, x[lane], y[lane]))});
      if (lane > 0) { // the differences at the very edge of the grid would leave it
        worst_slope = std::max(
            {worst_slope, std::fabs(at.u_x[lane] - by_x(0)), std::fabs(at.v_x[lane] - by_x(1)),
             std::fabs(at.u_y[lane] - by_y(0)), std::fabs(at.v_y[lane] - by_y(1))});
      }
    }
  }
  std::printf("spline flow: value %.1e m/s, gradient %.1e 1/s\n", worst, worst_slope);
  CHECK(worst < 1e-15);
  CHECK(worst_slope < 1e-7); // the differences themselves are good to 1e-8
}

void check_beyond_the_grid() {
  const Flow flow;
  const double x[8] = {-1, -0.07, 1, 0.09, 1e300, 0.0, 0.0, missing};
  const double y[8] = {0, 0, 0, 0, 0.07, 0.07, 2, 0};
  driftwalk::StripsOnGrid grid;
  const driftwalk::FlowAtStrips at =
      driftwalk::flow_at_strips(flow.view, Eight::load(x), Eight::load(y), grid);
  CHECK(at.u[0] == at.u[1] && at.v[0] == at.v[1]);
  CHECK(std::fabs(at.u[2] - at.u[3]) < 1e-15 && std::fabs(at.v[5] - at.v[6]) < 1e-15);
  CHECK(at.u_x[0] == 0 && at.u_y[0] != 0 && at.v_x[2] == 0 && at.v_y[6] == 0);
  CHECK(std::isfinite(at.u[4]) && std::isfinite(at.u[7]));
}

// --- the filter
// -----------------------------------------------------------------------------------
struct Circle {
  std::vector<double> time, x, y, theta, omega;
  std::vector<std::uint8_t> excluded;

  explicit Circle(int samples) {
    std::mt19937 random(9);
    std::normal_distribution<double> noise(0, 3e-4);
    for (int k = 0; k < samples; ++k) {
      const double t = 0.1 * k;
      time.push_back(t);
      x.push_back(0.03 * std::cos(0.7 * t) + noise(random));
      y.push_back(0.02 * std::sin(0.7 * t) + noise(random));
      theta.push_back(0.3 * t);
      omega.push_back(0.3);
      excluded.push_back(k % 11 == 10);
    }
  }
  driftwalk::Track view() const {
    return {time.data(),  x.data(), y.data(),        theta.data(),
            omega.data(), nullptr,  excluded.data(), std::int64_t(time.size())};
  }
};

DragModel drag_model(const Flow& flow, int strips = 8, Angle angle = Angle::given,
                     double drag_coefficient = 0.5) {
  return DragModel({0.03, 0.0116, 0.03, strips, 1000}, flow.view, flow.coefficients.data(),
                   drag_coefficient, angle);
}

constexpr driftwalk::FilterSettings settings{4.5e-5, 3e-4, 1e-4, 0.01, 0.05, 1.0};
constexpr double untouched = 12345;

struct Outputs {
  std::vector<double> innovation, covariance, state, whitened, jacobian;
  std::vector<std::uint8_t> used;

  // For d coordinates.
  Outputs(std::int64_t samples, std::int64_t parameters, int d)
      : innovation(std::size_t(d * samples), untouched),
        covariance(std::size_t(d * (d + 1) / 2 * samples), untouched),
        state(std::size_t(2 * d * samples), untouched),
        whitened(std::size_t(d * samples), untouched),
        jacobian(std::size_t(d * samples * parameters), untouched), used(std::size_t(samples), 77) {
  }

  driftwalk::FilterOutputs view() {
    return {innovation.data(), covariance.data(), used.data(),
            state.data(),      whitened.data(),   jacobian.data()};
  }
  bool complete() const {
    const auto holds_none = [](const std::vector<double>& values) {
      return std::find(values.begin(), values.end(), untouched) == values.end();
    };
    return holds_none(innovation) && holds_none(covariance) && holds_none(state) &&
           holds_none(whitened) && holds_none(jacobian) &&
           std::find(used.begin(), used.end(), 77) == used.end();
  }
};

Outputs run(const Circle& track, DragModel model) {
  InnovationsFilter filter(track.view(), std::move(model), settings, true);
  Outputs out(filter.samples(), filter.parameters(), filter.coordinates());
  filter.run(filter.samples() + 5, out.view());
  CHECK(filter.remaining() == 0);
  return out;
}

void check_that_all_is_written() {
  const Flow flow;
  for (const int strips : {1, 7, 8, 9, 64}) {
    for (const Angle angle : {Angle::given, Angle::none, Angle::state}) {
      Circle track(43);
      track.x[0] = track.y[17] = missing;
      track.x[30] = 1e200; // far beyond the grid
      const Outputs out = run(track, drag_model(flow, strips, angle));
      CHECK(out.complete());
      CHECK(std::count(out.used.begin(), out.used.end(), 1) > 25);
      CHECK(std::all_of(out.jacobian.begin(), out.jacobian.end(),
                        [](double value) { return std::isfinite(value); }));
    }
  }
}

// Where the state begins it has the velocity that is expected there, or none.
void check_velocity_prior() {
  const Flow flow;
  const Circle track(8);
  std::vector<double> prior(6 * 8, missing);
  const double expected[] = {0.02, -0.03, 0.4, 0.01, 0.01, 0.2};
  const auto begun = [&](const driftwalk::Track& view, int velocity) {
    InnovationsFilter filter(view, drag_model(flow, 8, Angle::state), settings, false);
    Outputs out(1, 1, 3);
    filter.run(1, {out.innovation.data(), out.covariance.data(), out.used.data(), out.state.data(),
                   nullptr, nullptr});
    return out.state[std::size_t(3 + velocity)];
  };
  driftwalk::Track view = track.view();
  view.velocity_prior = prior.data();
  CHECK(begun(view, 0) == 0 && begun(view, 2) == 0);
  std::copy(std::begin(expected), std::end(expected), prior.begin());
  for (int a = 0; a < 3; ++a) {
    CHECK(begun(view, a) == expected[a]);
  }
  prior[5] = -0.2;
  bool refused = false;
  try {
    begun(view, 0);
  } catch (const std::invalid_argument&) {
    refused = true;
  }
  CHECK(refused);
}

// A block larger than the whole grid, and one outside it: no strip may read or write past its end.
void check_small_grid() {
  Flow flow;
  flow.view.columns = flow.view.rows = 4;
  flow.view.origin_x = flow.view.origin_y = 0;
  const Circle track(40);
  CHECK(run(track, drag_model(flow)).complete());
}

bool same(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), [](double x, double y) {
           return x == y || (std::isnan(x) && std::isnan(y));
         });
}

void check_pieces(Angle angle) {
  const Flow flow;
  Circle track(50);
  if (angle == Angle::state) {
    track.theta[7] = track.theta[14] = missing;
    std::fill(track.omega.begin(), track.omega.end(), missing);
  }
  const Outputs whole = run(track, drag_model(flow, 8, angle));
  InnovationsFilter filter(track.view(), drag_model(flow, 8, angle), settings, true);
  const int d = filter.coordinates();
  CHECK(d == (angle == Angle::state ? 3 : 2));
  std::int64_t from = 0;
  for (const std::int64_t count : {1, 13, 0, 36}) {
    Outputs part(count, filter.parameters(), d);
    filter.run(count, part.view());
    const auto slice = [&](const std::vector<double>& values, std::int64_t width) {
      return std::vector<double>(values.begin() + from * width,
                                 values.begin() + (from + count) * width);
    };
    CHECK(same(part.innovation, slice(whole.innovation, d)));
    CHECK(same(part.covariance, slice(whole.covariance, d * (d + 1) / 2)));
    CHECK(same(part.state, slice(whole.state, 2 * d)));
    CHECK(same(part.whitened, slice(whole.whitened, d)));
    CHECK(same(part.jacobian, slice(whole.jacobian, d * filter.parameters())));
    from += count;
  }
  CHECK(filter.remaining() == 0);
}

// The sums over the samples against the derivatives that a run hands out, column by column. Of
// every product that is left out one factor is below 1e-4 of the largest derivative.
void check_sums() {
  const Flow flow;
  const Circle track(90);
  for (const Angle angle : {Angle::given, Angle::none, Angle::state}) {
    const Outputs whole = run(track, drag_model(flow, 8, angle));
    InnovationsFilter filter(track.view(), drag_model(flow, 8, angle), settings, true);
    const std::int64_t n = filter.samples(), d = filter.coordinates(), p = filter.parameters();
    std::vector<std::uint8_t> kept(std::size_t(n), 1);
    kept[20] = kept[61] = 0;
    std::vector<double> right(std::size_t(n * d * 2));
    for (std::size_t k = 0; k < right.size(); ++k) {
      right[k] = std::sin(double(k));
    }
    Outputs out(n, 0, int(d));
    const InnovationsFilter::Sums sums = filter.sums(kept.data(), right.data(), 2, 1, out.view());
    CHECK(filter.remaining() == 0);
    std::vector<double> information(std::size_t(p * p), 0), products(std::size_t(2 * p), 0);
    std::vector<double> total(std::size_t(p), 0);
    double largest = 0, beside = 0;
    for (std::int64_t row = 0; row < n * d; ++row) {
      const double* const J = whole.jacobian.data() + row * p;
      for (std::int64_t i = 0; kept[std::size_t(row / d)] != 0 && i < p; ++i) {
        for (std::int64_t j = 0; j < p; ++j) {
          information[std::size_t(i * p + j)] += J[i] * J[j];
        }
        products[std::size_t(i)] += J[i] * right[std::size_t(2 * row)];
        products[std::size_t(p + i)] += J[i] * right[std::size_t(2 * row + 1)];
        total[std::size_t(i)] += std::fabs(J[i]);
        largest = std::max(largest, std::fabs(J[i]));
      }
      beside += std::fabs(right[std::size_t(2 * row)]);
    }
    CHECK(sums.information.size() == information.size() && sums.products.size() == products.size());
    double worst = 0, most = 0, apart = 0;
    for (std::int64_t i = 0; i < p; ++i) {
      for (std::int64_t j = 0; j < p; ++j) {
        const std::size_t k = std::size_t(i * p + j);
        const double error = std::fabs(sums.information[k] - information[k]);
        const double allowed =
            1e-4 * largest * std::max(total[std::size_t(i)], total[std::size_t(j)]);
        worst = std::max(worst, error / (allowed + 1e-14 * largest * largest));
        most = std::max(most, std::fabs(information[k]));
        apart = std::max(apart, error);
      }
    }
    std::printf("sums: %.1e of the largest left out, %.1e of what may be\n", apart / most, worst);
    CHECK(worst < 1);
    CHECK(apart < 1e-4 * most);
    for (std::size_t k = 0; k < products.size(); ++k) {
      CHECK(std::fabs(sums.products[k] - products[k]) < 1e-4 * largest * (beside + 1));
    }
  }
}

// What the slope of the drag leaves out where velocities are uncertain, by Gauss and Hermite's rule
// of three points a velocity. As long as no strip changes between windward and leeward the drag is
// quadratic in the velocities, and the rule exact.
template <int D>
void check_bend() {
  const Flow flow;
  const DragModel model = drag_model(flow, 8, D == 3 ? Angle::state : Angle::given);
  std::mt19937 random(8);
  std::uniform_real_distribution<double> draw(-1, 1);
  const double at[3] = {-std::sqrt(3.0), 0, std::sqrt(3.0)};
  const double weight[3] = {1.0 / 6, 2.0 / 3, 1.0 / 6};
  const double known[2 * D][2 * D] = {};
  double worst = 0;
  for (int trial = 0; trial < 20; ++trial) {
    const double theta = 3 * draw(random), omega = 2 * draw(random);
    double mean[2 * D] = {0.03 * draw(random), 0.02 * draw(random)};
    mean[D] = 0.1 * draw(random);
    mean[D + 1] = 0.1 * draw(random);
    if constexpr (D == 3) {
      mean[2] = theta;
      mean[5] = omega;
    }
    // The velocities' covariance is R R'.
    double R[D][D], P[2 * D][2 * D] = {};
    for (int a = 0; a < D; ++a) {
      for (int b = 0; b < D; ++b) {
        R[a][b] = (a < 2 ? 3e-6 : 3e-4) * (draw(random) + (a == b ? 2 : 0));
      }
    }
    for (int a = 0; a < D; ++a) {
      for (int b = 0; b < D; ++b) {
        for (int c = 0; c < D; ++c) {
          P[a + D][b + D] += R[a][c] * R[b][c];
        }
      }
    }
    const driftwalk::DragResponse<D> drag = model.drag<D>(theta, omega, mean, P, nullptr);
    double wanted[D][D] = {}, size[D] = {};
    for (int point = 0; point < (D == 3 ? 27 : 9); ++point) {
      const int place[3] = {point % 3, point / 3 % 3, point / 9};
      double moved[2 * D], shift[D] = {}, share = 1;
      std::copy(mean, mean + 2 * D, moved);
      for (int c = 0; c < D; ++c) {
        share *= weight[place[c]];
        for (int a = 0; a < D; ++a) {
          shift[a] += R[a][c] * at[place[c]];
        }
      }
      for (int a = 0; a < D; ++a) {
        moved[a + D] += shift[a];
      }
      const driftwalk::DragResponse<D> there =
          model.drag<D>(theta, D == 3 ? moved[2 * D - 1] : omega, moved, known, nullptr);
      double rest[D];
      for (int a = 0; a < D; ++a) {
        rest[a] = there.acceleration[a] - drag.acceleration[a];
        for (int b = 0; b < D; ++b) {
          rest[a] -= drag.by_velocity[a][b] * shift[b];
        }
      }
      for (int a = 0; a < D; ++a) {
        for (int b = 0; b < D; ++b) {
          wanted[a][b] += share * rest[a] * rest[b];
        }
      }
    }
    double found[D][D];
    driftwalk::bend_covariance<D>(drag, P, found);
    for (int a = 0; a < D; ++a) {
      size[a] = std::sqrt(wanted[a][a]);
    }
    for (int a = 0; a < D; ++a) {
      for (int b = 0; b < D; ++b) {
        worst = std::max(worst, std::fabs(found[a][b] - wanted[a][b]) / (size[a] * size[b]));
      }
    }
  }
  std::printf("bend of the drag, %d coordinates: %.1e\n", D, worst);
  CHECK(worst < 1e-4);
}

// Eight orientations against 720, in random flows.
void check_orientations() {
  double worst = 0;
  const Flow flow;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> draw(-1, 1);
  const double known[4][4] = {{1e-8, 0, 0, 0}, {0, 1e-8, 0, 0}, {0, 0, 1e-5, 0}, {0, 0, 0, 1e-5}};
  const DragModel turned = drag_model(flow), averaged = drag_model(flow, 8, Angle::none);
  for (int k = 0; k < 50; ++k) {
    const double mean[4] = {0.03 * draw(random), 0.02 * draw(random), 0.1 * draw(random),
                            0.1 * draw(random)};
    double x = 0, y = 0;
    for (int i = 0; i < 90; ++i) {
      const driftwalk::DragResponse<2> one =
          turned.drag<2>(i * std::acos(-1.0) / 180, 0, mean, known, nullptr);
      x += one.acceleration[0] / 90;
      y += one.acceleration[1] / 90;
    }
    const driftwalk::DragResponse<2> all = averaged.drag<2>(0.7, 3, mean, known, nullptr);
    worst = std::max(worst, std::hypot(all.acceleration[0] - x, all.acceleration[1] - y) /
                                std::hypot(x, y));
  }
  std::printf("eight orientations: %.1e\n", worst);
  CHECK(worst < 1e-2);
}

template <class Make>
bool refuses(const Make& make) {
  try {
    make();
  } catch (const std::invalid_argument&) {
    return true;
  }
  return false;
}

void check_refusals() {
  const Flow flow;
  CHECK(refuses([&] { drag_model(flow, 0); }));
  CHECK(refuses([&] { drag_model(flow, 8, Angle::given, -1); }));
  Flow narrow;
  narrow.view.columns = 3;
  CHECK(refuses([&] { drag_model(narrow); }));
  Circle track(5);
  track.time[3] = track.time[2];
  CHECK(refuses([&] { InnovationsFilter(track.view(), drag_model(flow), settings, true); }));
}

} // namespace

int main() {
  check_normal_law();
  check_quadratic_moments();
  check_flow();
  check_beyond_the_grid();
  check_that_all_is_written();
  check_velocity_prior();
  check_small_grid();
  check_pieces(Angle::given);
  check_pieces(Angle::none);
  check_pieces(Angle::state);
  check_sums();
  check_bend<2>();
  check_bend<3>();
  check_orientations();
  check_refusals();
  return check::result();
}
