// The loop of a pack of worlds through a whole run: forces, steps, samples.
#pragma once

#include "driftwalk/random/normal.hpp"
#include "driftwalk/random/philox.hpp"
#include "driftwalk/simulate/prepared.hpp"
#include "driftwalk/simulate/step.hpp"

DRIFTWALK_LANES_BEGIN

// Where the samples of the worlds from lane `lane` on go.
template <class T>
inline SampleSink<T> samples_from(const SampleSink<T>& sink, std::int64_t lane) {
  const std::int64_t offset = lane * sink.lane_stride;
  return {sink.x + offset, sink.y + offset, sink.theta == nullptr ? nullptr : sink.theta + offset,
          sink.lane_stride};
}

template <class Real>
inline void load_worlds(const BatchWorlds& worlds, std::int64_t first, int count, Body<Real>& state,
                        Real& drag_coefficient, Real& force_std,
                        Philox<typename Numbers<Real>::UInt>& stream) {
  constexpr int lanes = Numbers<Real>::lanes;
  // Lanes beyond the last world repeat it; nothing of theirs is written.
  double column[8][lanes];
  UInt32 low[lanes], high[lanes];
  for (int lane = 0; lane < lanes; ++lane) {
    const std::int64_t world = first + (lane < count ? lane : count - 1);
    // A start angle may count turns; the kernels keep theirs within [-pi, pi].
    const double theta = __builtin_remainder(worlds.theta[world], 2 * pi_value);
    const double values[8] = {worlds.x[world],
                              worlds.y[world],
                              theta,
                              worlds.vx[world],
                              worlds.vy[world],
                              worlds.omega[world],
                              worlds.drag_coefficient[world],
                              worlds.force_std[world]};
    for (int k = 0; k < 8; ++k) {
      column[k][lane] = values[k];
    }
    low[lane] = static_cast<UInt32>(worlds.key[world]);
    high[lane] = static_cast<UInt32>(worlds.key[world] >> 32);
  }
  load_lanes(column[0], state.pose.x);
  load_lanes(column[1], state.pose.y);
  load_lanes(column[2], state.pose.theta);
  load_lanes(column[3], state.motion.vx);
  load_lanes(column[4], state.motion.vy);
  load_lanes(column[5], state.motion.omega);
  load_lanes(column[6], drag_coefficient);
  load_lanes(column[7], force_std);
  std::memcpy(&stream.key0, low, sizeof low);
  std::memcpy(&stream.key1, high, sizeof high);
  const Real zero{typename Numbers<Real>::Scalar(0)};
  state.drag = {zero, zero, zero};
}

// Four standard normal numbers of a purpose at a position of its stream.
template <class Real>
inline void draw_normals(const Philox<typename Numbers<Real>::UInt>& stream, Purpose purpose,
                         std::int64_t index, Real* out) {
  using UInt = typename Numbers<Real>::UInt;
  UInt words[4];
  stream(UInt(static_cast<UInt32>(index)), UInt(static_cast<UInt32>(0)),
         UInt(static_cast<UInt32>(index >> 32)), UInt(static_cast<UInt32>(purpose)), words);
  normal_pair(words[0], words[1], out[0], out[1]);
  normal_pair(words[2], words[3], out[2], out[3]);
}

// The nearest multiple of `quantum`; what has no number of quanta in 31 bits stays as it is, a NaN
// above all.
template <class Real, class T>
inline Real quantise(Real value, T quantum) {
  const T most = T(1 << 30);
  const Real scaled = value / Real(quantum);
  const Real bounded = clamp_to(scaled, -most, most);
  const Real rounded =
      to_real(value, truncate(bounded + copy_sign(Real(T(0.5)), bounded))) * quantum;
  return select(abs(scaled) < Real(most), rounded, value);
}

// Makes the normal numbers of a force that remembers, (x, y), out of fresh ones and the last.
template <class Real>
inline void remember(Real kept, Real fresh, const Real* last, Real* normals) {
  normals[0] = kept * last[0] + fresh * normals[0];
  normals[1] = kept * last[1] + fresh * normals[1];
}

template <class T>
inline bool is_seen(const Prepared<T>& run, T x, T y) {
  if (run.view_radius > T(0)) {
    const T dx = x - run.view_x, dy = y - run.view_y;
    return dx * dx + dy * dy <= run.view_radius * run.view_radius;
  }
  for (int e = 0; e < run.view_edge_count; ++e) {
    const PreparedEdge<T>& edge = run.view_edges[e];
    if (x * edge.normal_x + y * edge.normal_y > edge.distance) {
      return false;
    }
  }
  return true;
}

template <class T>
inline void write_missing(const SampleSink<T>& sink, std::int64_t at) {
  const T missing = static_cast<T>(__builtin_nan(""));
  sink.x[at] = sink.y[at] = missing;
  if (sink.theta != nullptr) {
    sink.theta[at] = missing;
  }
}

// The pose as the camera reports it, written to every lane's own column.
template <class Real, class T>
inline void write_sample(const Prepared<T>& run, const SampleSink<T>& sink, std::int64_t sample,
                         int count, const Philox<typename Numbers<Real>::UInt>& stream, Real x,
                         Real y, Real theta) {
  if (run.position_noise > T(0) || run.orientation_noise > T(0)) {
    Real noise[4];
    draw_normals(stream, Purpose::observation, sample, noise);
    x = x + noise[0] * run.position_noise;
    y = y + noise[1] * run.position_noise;
    theta = theta + noise[2] * run.orientation_noise;
    // Noise of the largest allowed spread, 3.2 rad, can add up to three turns.
    theta = wrap_angle(wrap_angle(theta));
  }
  if (run.position_quantum > T(0)) {
    x = quantise(x, run.position_quantum);
    y = quantise(y, run.position_quantum);
  }
  theta = wrap_angle(theta);
  const bool sees_all = run.view_radius <= T(0) && run.view_edge_count == 0;
  for (int lane = 0; lane < count; ++lane) {
    const std::int64_t at = lane * sink.lane_stride + sample;
    sink.x[at] = lane_of(x, lane);
    sink.y[at] = lane_of(y, lane);
    if (sink.theta != nullptr) {
      sink.theta[at] = lane_of(theta, lane);
    }
    if (!sees_all && !is_seen(run, sink.x[at], sink.y[at])) {
      write_missing(sink, at);
    }
  }
}

// The clocks of a pack's flow in frames: where each lane is among them, and what it reads there.
// Lanes that are not begun stand at time 0.
template <class T>
class FlowClocks {
public:
  FlowClocks() = default;
  FlowClocks(const FlowClocks&) = delete;
  FlowClocks& operator=(const FlowClocks&) = delete;

  // The world of a lane begins at this time on the clock of the frames [s].
  void begin(int lane, double start) { start_[lane] = start; }
  // The same for the worlds of a pack; lanes beyond the last world repeat it.
  void begin(const BatchWorlds& worlds, std::int64_t first, int count, int lanes) {
    for (int lane = 0; lane < lanes && worlds.flow_start != nullptr; ++lane) {
      begin(lane, worlds.flow_start[first + (lane < count ? lane : count - 1)]);
    }
  }

  // Lets the views of a pack read at a time since the start of a lane's world; `strength` is a
  // factor on the flow.
  void look(const Prepared<T>& run, int lane, double elapsed, T strength) {
    const SeriesTime now = series_time(run, start_[lane] + elapsed);
    const double* const time = run.frame_time;
    // From where the lane was: the frame found does not depend on where the search begins.
    int frame = frame_[lane];
    while (frame + 2 < run.frames && time[frame + 1] <= now.time) {
      ++frame;
    }
    while (frame > 0 && time[frame] > now.time) {
      --frame;
    }
    frame_[lane] = frame;
    const double share = (now.time - time[frame]) / (time[frame + 1] - time[frame]);
    const T weight = static_cast<T>(share < 0 ? 0 : (share > 1 ? 1 : share));
    flow_.before[lane] = run.flow.table + frame * run.frame_size;
    flow_.after[lane] = flow_.before[lane] + run.frame_size;
    flow_.weight[lane] = weight;
    if (run.water.count > 0) {
      // Before the first frame and after the last the flow stands.
      const T rate = share < 0 || share > 1 ? T(0) : now.backwards ? -strength : strength;
      look_at_water(run, lane, frame, weight, strength * strength, rate);
    }
  }

  void show(FlowView<T>& flow, WaterView<T>& water) const {
    flow.lanes = &flow_;
    water.lanes = &water_;
  }
  void show(FlowView<T>& flow) const { flow.lanes = &flow_; }

private:
  struct SeriesTime {
    double time;
    bool backwards;
  };

  static SeriesTime series_time(const Prepared<T>& run, double time) {
    if (run.repeat == FlowRepeat::hold) {
      return {time, false};
    }
    const double first = run.frame_time[0], span = run.frame_time[run.frames - 1] - first;
    const double turn = __builtin_floor((time - first) / span);
    const double within = (time - first) - turn * span;
    const bool backwards =
        run.repeat == FlowRepeat::mirror && turn != 2 * __builtin_floor(turn / 2);
    return {first + (backwards ? span - within : within), backwards};
  }

  // The tables of the water's acceleration (prepare_water.cpp).
  void look_at_water(const Prepared<T>& run, int lane, int frame, T weight, T twice, T rate) {
    const T before = T(1) - weight;
    const T part[most_water_tables] = {before * before * twice, T(2) * weight * before * twice,
                                       rate, weight * weight * twice};
    for (int k = 0; k < most_water_tables; ++k) {
      LaneTables<T>& table = water_.table[k];
      table.before[lane] = table.after[lane] =
          run.water.nodes.table + (3 * frame + k) * run.frame_size;
      table.weight[lane] = T(0);
      water_.part[k][lane] = static_cast<double>(part[k]);
    }
  }

  double start_[most_lanes] = {};
  int frame_[most_lanes] = {};
  LaneTables<T> flow_;
  LaneWater<T> water_;
};

// Path length of a world in the second half of its samples, before camera noise. It reveals a
// world at rest, whatever the noise does to its recorded steps.
template <class Real>
struct Motionless {
  using T = typename Numbers<Real>::Scalar;
  Real x, y, path;
  std::int64_t from;
  T threshold;

  Motionless() = default;
  template <class Run>
  explicit Motionless(const Run& run) : x(T(0)), y(T(0)), path(T(0)), from(run.samples / 2) {
    constexpr double slowest = 1e-6; // [m/s]
    const std::int64_t steps = run.sample_step[run.samples - 1] - run.sample_step[from];
    threshold =
        static_cast<T>(slowest * static_cast<double>(steps) * static_cast<double>(run.step.dt));
  }

  inline void add(std::int64_t sample, Real new_x, Real new_y) {
    if (sample > from) {
      path = path + abs(new_x - x) + abs(new_y - y);
    }
    x = new_x;
    y = new_y;
  }
};

template <class Real, class T>
inline typename Numbers<Real>::Bool is_sound(const Prepared<T>& run, const Body<Real>& body) {
  const Real margin{run.shape.panel_count > 0 ? run.shape.reach : run.block.half_side};
  return (body.pose.x > Real(run.flow.low_x) - margin) &
         (body.pose.x < Real(run.flow.high_x) + margin) &
         (body.pose.y > Real(run.flow.low_y) - margin) &
         (body.pose.y < Real(run.flow.high_y) + margin);
}

// The state at the end of a run says whether every number on the way was one: a NaN never heals.
template <class Real, class T>
inline void write_status(const Prepared<T>& run, const Body<Real>& body,
                         const Motionless<Real>& rest, int count, std::uint32_t* status) {
  const Real total = body.pose.x + body.pose.y + body.pose.theta + body.motion.vx + body.motion.vy;
  const auto finite = abs(total) < Real(T(1e30));
  const auto inside = is_sound(run, body);
  for (int lane = 0; lane < count; ++lane) {
    status[lane] = (lane_of(finite, lane) ? 0u : status_non_finite) |
                   (lane_of(inside, lane) ? 0u : status_escaped) |
                   (lane_of(rest.path, lane) < rest.threshold ? status_no_motion : 0u);
  }
}

// Packs that one call takes through their runs together.
template <class Real, class T, class Law>
class WorldGroup {
public:
  WorldGroup(const Prepared<T>& run, const BatchWorlds& worlds, std::int64_t first, int count,
             const SampleSink<T>& sink)
      : run_(run), sink_(sink), packs_((count + lanes - 1) / lanes) {
    for (int p = 0; p < packs_; ++p) {
      const int offset = p * lanes, left = count - offset;
      load(p, worlds, first + offset, left < lanes ? left : lanes);
    }
  }

  void run() {
    for (std::int64_t interval = 0; sample_ < run_.samples; ++interval) {
      for (int p = 0; p < packs_; ++p) {
        draw_force(interval, pack_[p].noise, record_[p], pack_[p].physics.world.noise_scale);
      }
      for (int sub = 0; sub < run_.steps_per_interval && sample_ < run_.samples; ++sub) {
        step();
      }
    }
  }

  void write_status(std::uint32_t* status) const {
    for (int p = 0; p < packs_; ++p) {
      driftwalk::write_status(run_, pack_[p].body, record_[p].rest, record_[p].count,
                              status + p * lanes);
    }
  }

private:
  static constexpr int lanes = Numbers<Real>::lanes;
  using UInt = typename Numbers<Real>::UInt;

  // What a pack has beside its blocks.
  struct Record {
    int count; // of its worlds
    Philox<UInt> stream;
    Real normals[4], last[2];
    Real torque[4], last_torque;
    Motionless<Real> rest;
    FlowClocks<T> clocks;
  };

  void load(int p, const BatchWorlds& worlds, std::int64_t first, int count) {
    BlockPack<Real, T, Law>& pack = pack_[p];
    Record& record = record_[p];
    Real drag_coefficient, force_std;
    load_worlds(worlds, first, count, pack.body, drag_coefficient, force_std, record.stream);
    record.count = count;
    record.last[0] = record.last[1] = record.last_torque = Real(T(0));
    record.rest = Motionless<Real>(run_);
    const Law law = Law::of(drag_coefficient, run_.drag);
    pack.physics = {law,        run_.block,
                    run_.shape, run_.flow,
                    run_.water, run_.wall,
                    run_.step,  world_constants(law, run_, drag_coefficient, force_std)};
    if (run_.frames > 1) {
      record.clocks.begin(worlds, first, count, lanes);
      record.clocks.show(pack.physics.flow, pack.physics.water);
    }
    const Real per_inertia{run_.step.per_inertia};
    if (run_.shape.panel_count > 0) {
      meet_wall(run_.wall, run_.shape, per_inertia, pack.body.pose, pack.body.motion);
    } else {
      meet_wall(run_.wall, run_.block.half_side, per_inertia, pack.body.pose, pack.body.motion);
    }
  }

  void draw_force(std::int64_t interval, Motion<Real>& noise, Record& record, Real scale) const {
    // One Philox block serves two force intervals.
    const int half = static_cast<int>(interval & 1) * 2;
    if (half == 0) {
      draw_normals(record.stream, Purpose::force, interval >> 1, record.normals);
    }
    Real* const normals = record.normals + half;
    if (run_.force_kept > T(0)) {
      const T kept = interval == 0 ? T(0) : run_.force_kept;
      const T fresh = interval == 0 ? run_.force_first : T(1) - run_.force_kept;
      remember(Real(kept), Real(fresh), record.last, normals);
      record.last[0] = normals[0];
      record.last[1] = normals[1];
    }
    noise = {normals[0] * scale, normals[1] * scale, Real(T(0))};
    if (run_.force_lever > T(0)) {
      noise.omega =
          torque_normal(interval, record) * scale * (run_.force_lever * run_.step.per_inertia);
    }
  }

  // The normal number of the stochastic torque, as draw_force makes those of the force.
  Real torque_normal(std::int64_t interval, Record& record) const {
    if ((interval & 1) == 0) {
      draw_normals(record.stream, Purpose::torque, interval >> 1, record.torque);
    }
    Real& normal = record.torque[interval & 1];
    if (run_.force_kept > T(0)) {
      const T kept = interval == 0 ? T(0) : run_.force_kept;
      const T fresh = interval == 0 ? run_.force_first : T(1) - run_.force_kept;
      normal = kept * record.last_torque + fresh * normal;
      record.last_torque = normal;
    }
    return normal;
  }

  void step() {
    if (run_.frames > 1) {
      look_at_flow();
    }
    step_packs(pack_, packs_);
    for (; sample_ < run_.samples && run_.sample_step[sample_] == step_index_; ++sample_) {
      for (int p = 0; p < packs_; ++p) {
        write(p, run_.sample_weight[sample_]);
      }
    }
    ++step_index_;
  }

  void look_at_flow() {
    const double middle =
        (static_cast<double>(step_index_) + 0.5) * static_cast<double>(run_.step.dt);
    for (int p = 0; p < packs_; ++p) {
      for (int lane = 0; lane < lanes; ++lane) {
        record_[p].clocks.look(run_, lane, middle, T(1));
      }
    }
  }

  void write(int p, T weight) {
    const Pose<Real>& before = pack_[p].before;
    const Pose<Real>& pose = pack_[p].body.pose;
    Record& record = record_[p];
    const Real x = before.x + (pose.x - before.x) * weight;
    const Real y = before.y + (pose.y - before.y) * weight;
    record.rest.add(sample_, x, y);
    write_sample(run_, samples_from(sink_, p * lanes), sample_, record.count, record.stream, x, y,
                 wrap_angle(before.theta + pack_[p].turned * weight));
  }

  const Prepared<T>& run_;
  const SampleSink<T>& sink_;
  const int packs_;
  BlockPack<Real, T, Law> pack_[most_packs];
  Record record_[most_packs];
  std::int64_t step_index_ = 0, sample_ = 0;
};

// Up to most_packs packs of worlds.
template <class Real, class T, class Law>
void run_worlds(const Prepared<T>& run, const BatchWorlds& worlds, std::int64_t first, int count,
                const SampleSink<T>& sink, std::uint32_t* status) {
  WorldGroup<Real, T, Law> group(run, worlds, first, count, sink);
  group.run();
  group.write_status(status);
}

DRIFTWALK_LANES_END
