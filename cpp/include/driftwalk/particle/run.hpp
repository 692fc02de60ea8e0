// The loop of a pack of particles through a whole run: steps and samples.
#pragma once

#include "driftwalk/math/atan2.hpp"
#include "driftwalk/particle/inertial.hpp"
#include "driftwalk/particle/switching.hpp"

DRIFTWALK_LANES_BEGIN

// The angle of a vector in every lane [rad].
template <class Real>
inline Real angle_of(Real x, Real y) {
  constexpr int lanes = Numbers<Real>::lanes;
  double angle[lanes];
  for (int lane = 0; lane < lanes; ++lane) {
    angle[lane] =
        atan2(static_cast<double>(lane_of(y, lane)), static_cast<double>(lane_of(x, lane)));
  }
  Real out;
  load_lanes(angle, out);
  return out;
}

template <class Real, class Particle, class T>
void run_particles(const Prepared<T>& run, const BatchWorlds& worlds, std::int64_t first, int count,
                   const SampleSink<T>& sink, std::uint32_t* status) {
  const ColumnReader<Real> columns(worlds, first, count);
  Particle particle(columns, worlds, static_cast<double>(run.step.dt));
  FlowView<T> flow = run.flow;
  FlowClocks<T> clocks;
  const bool changes = run.frames > 1 && worlds.particle.carried;
  if (changes) {
    clocks.begin(worlds, first, count, Numbers<Real>::lanes);
    clocks.show(flow);
  }
  Motionless<Real> rest(run);
  std::int64_t sample = 0;
  for (std::int64_t index = 0; sample < run.samples; ++index) {
    const double middle = (static_cast<double>(index) + 0.5) * static_cast<double>(run.step.dt);
    for (int lane = 0; lane < Numbers<Real>::lanes && changes; ++lane) {
      clocks.look(run, lane, middle, T(1));
    }
    const Real x = particle.x(), y = particle.y();
    particle.step(run.wall, flow, index);
    for (; sample < run.samples && run.sample_step[sample] == index; ++sample) {
      const T weight = run.sample_weight[sample];
      const Real sample_x = x + (particle.x() - x) * weight;
      const Real sample_y = y + (particle.y() - y) * weight;
      rest.add(sample, sample_x, sample_y);
      // Angles cost more than a step: only for those who take them.
      const Real theta = sink.theta == nullptr
                             ? Real(T(0))
                             : angle_of(particle.ahead_x(weight), particle.ahead_y(weight));
      write_sample(run, sink, sample, count, particle.stream(), sample_x, sample_y, theta);
    }
  }
  const Real zero{T(0)};
  const Body<Real> body{{particle.x(), particle.y(), zero},
                        {particle.ahead_x(T(1)), particle.ahead_y(T(1)), zero},
                        {zero, zero, zero}};
  write_status(run, body, rest, count, status);
}

// The same for the kind of particle that the batch asks for.
template <class Real, class T>
void run_particle_kind(const Prepared<T>& run, const BatchWorlds& worlds, std::int64_t first,
                       int count, const SampleSink<T>& sink, std::uint32_t* status) {
  if (worlds.particle.kind == ParticleKind::inertial) {
    run_particles<Real, InertialParticle<Real>>(run, worlds, first, count, sink, status);
  } else {
    run_particles<Real, SwitchingParticle<Real>>(run, worlds, first, count, sink, status);
  }
}

DRIFTWALK_LANES_END
