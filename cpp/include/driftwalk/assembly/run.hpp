// The loop of a pack of worlds with several blocks. A world that is over frees its lane for the
// next one in the queue; nothing a world does depends on its lane or its neighbours.
#pragma once

#include "driftwalk/assembly/lane.hpp"
#include "driftwalk/assembly/near.hpp"
#include "driftwalk/assembly/walls.hpp"
#include "driftwalk/random/normal.hpp"
#include "driftwalk/simulate/run.hpp"

DRIFTWALK_LANES_BEGIN

template <class Real, class T>
class AssemblyPack {
public:
  static constexpr int lanes = Numbers<Real>::lanes;
  using Bool = typename Numbers<Real>::Bool;
  using UInt = typename Numbers<Real>::UInt;
  using Node = typename FlowNumber<T>::type;

  AssemblyPack(const Prepared<T>& run, const AssemblyRules& rules, const AssemblyWorlds& worlds,
               const AssemblyOutputs& out, const WorldQueue& queue, AssemblyScratch& scratch,
               Node* blended_flow)
      : run_(run), rules_(rules), worlds_(worlds), out_(out), queue_(queue), scratch_(scratch),
        blended_flow_(blended_flow), memory_(scratch.lanes, rules.blocks), near_(rules),
        blocks_(rules.blocks), listed_(rules.blocks > most_blocks_all_pairs),
        physics_{{run.half_side, run.strip_width, run.strips},
                 run.flow,
                 {run.radius, run.edges, run.edge_count, run.restitution, run.friction,
                  run.bounce_speed},
                 {run.dt, run.per_dt, run.per_inertia},
                 {Real(T(0)), Real(T(0))},
                 Real(T(0))} {
    for (int lane = 0; lane < lanes; ++lane) {
      // Lanes without a world move the first one's blocks along; nothing of theirs is written.
      load_lane<Real, T>(rules_, worlds_, 0, memory_, lane);
      books_[lane].pairs.pair = memory_.pairs + (listed_ ? pair_capacity(blocks_) * lane : 0);
      put(stream_.key0, lane, 0);
      put(stream_.key1, lane, 0);
      put(draw_, lane, 0);
    }
    for (int b = 0; b < blocks_; ++b) {
      memory_.listed_x[b] = memory_.listed_y[b] = Real(T(0));
    }
  }

  // Returns the number of block-steps of the worlds that were run.
  std::int64_t run() {
    // Lanes take a new world where a block of random numbers begins: every two force intervals.
    const std::int64_t period = 2 * std::int64_t(run_.steps_per_interval);
    for (std::int64_t step = 0;; ++step) {
      const std::int64_t phase = step % period;
      if (phase == 0) {
        if (!refill(step)) {
          return block_steps_;
        }
        draw_forces();
      }
      if (run_.frames > 1) {
        blend_flow(step);
      }
      advance(physics_, phase < run_.steps_per_interval ? 0 : 1, memory_.members, memory_.sums,
              blocks_);
      meet_walls(physics_, memory_.members, blocks_);
      settle_lanes(step);
      end_step(step + 1);
    }
  }

private:
  // False when no lane has a world any more.
  bool refill(std::int64_t step) {
    bool some = false;
    for (const LaneBook& book : books_) {
      some = some || book.running;
    }
    // Worlds in a flow that changes share its clock: they begin together.
    const bool may_begin = run_.frames == 1 || !some;
    for (int lane = 0; lane < lanes && may_begin; ++lane) {
      if (!books_[lane].running && !empty_) {
        const std::int64_t world = queue_.take(queue_.self);
        empty_ = world >= worlds_.count;
        if (!empty_) {
          begin(world, lane, step);
          some = true;
        }
      }
    }
    return some;
  }

  void begin(std::int64_t world, int lane, std::int64_t step) {
    LaneBook& book = books_[lane];
    book.world = world;
    book.first_step = step;
    book.event_count = 0;
    book.first_contact = -1;
    book.assemblies = blocks_;
    book.running = true;
    load_lane<Real, T>(rules_, worlds_, world, memory_, lane);
    const double drag = worlds_.drag_coefficient[world];
    // The same roundings as in the one-block kernel.
    put(physics_.drag.drag_per_mass, lane,
        static_cast<T>(drag) * static_cast<T>(run_.drag_scale / run_.mass));
    put(physics_.drag.drag_per_inertia, lane,
        static_cast<T>(drag) * static_cast<T>(run_.drag_scale / run_.inertia));
    put(physics_.noise_scale, lane,
        static_cast<T>(worlds_.force_std[world]) * static_cast<T>(1.0 / run_.mass));
    put(stream_.key0, lane, static_cast<UInt32>(worlds_.key[world]));
    put(stream_.key1, lane, static_cast<UInt32>(worlds_.key[world] >> 32));
    put(draw_, lane, 0);
    if (listed_) {
      list_pairs(lane);
    }
    if (out_.sample_every > 0) {
      write_moment<Real, T>(rules_, out_, memory_, lane, world, 0);
    }
    next_event_ = next_event_ < step + worlds_.steps ? next_event_ : step + worlds_.steps;
  }

  void draw_forces() {
    for (int b = 0; b < blocks_; ++b) {
      UInt words[4];
      stream_(draw_, UInt(static_cast<UInt32>(b)), UInt(static_cast<UInt32>(0)),
              UInt(static_cast<UInt32>(Purpose::force)), words);
      Real* const normals = memory_.members[b].normals;
      normal_pair(words[0], words[1], normals[0], normals[1]);
      normal_pair(words[2], words[3], normals[2], normals[3]);
    }
    draw_ = draw_ + UInt(static_cast<UInt32>(1));
  }

  void blend_flow(std::int64_t step) {
    std::int64_t first = 0;
    for (const LaneBook& book : books_) {
      first = book.running ? book.first_step : first;
    }
    const double middle = (static_cast<double>(step - first) + 0.5) * static_cast<double>(run_.dt);
    physics_.flow.table = flow_table_at(run_, middle, blended_flow_);
  }

  void settle_lanes(std::int64_t step) {
    if (listed_) {
      renew_lists();
      for (int lane = 0; lane < lanes; ++lane) {
        if (books_[lane].running &&
            lane_to_settle(near_, memory_.members, books_[lane].pairs, lane)) {
          settle_lane(step, lane);
        }
      }
      return;
    }
    const Bool unsettled = lanes_to_settle(near_, memory_.members, blocks_);
    if (any(unsettled)) {
      for (int lane = 0; lane < lanes; ++lane) {
        if (books_[lane].running && lane_of(unsettled, lane)) {
          settle_lane(step, lane);
        }
      }
    }
  }

  // Lists of near pairs reach half a skin beyond what touches on either side.
  void renew_lists() {
    const Real limit{
        static_cast<T>(0.25 * pair_skin_sides * pair_skin_sides * rules_.side * rules_.side)};
    Real farthest{T(0)};
    for (int b = 0; b < blocks_; ++b) {
      const Real dx = memory_.members[b].x - memory_.listed_x[b];
      const Real dy = memory_.members[b].y - memory_.listed_y[b];
      farthest = max(dx * dx + dy * dy, farthest);
    }
    const Bool stale = farthest > limit;
    if (any(stale)) {
      for (int lane = 0; lane < lanes; ++lane) {
        if (books_[lane].running && lane_of(stale, lane)) {
          list_pairs(lane);
        }
      }
    }
  }

  void list_pairs(int lane) {
    Scene& scene = scratch_.scene;
    fill_scene(rules_, memory_, lane, books_[lane].assemblies, scene);
    scene.pairs = books_[lane].pairs;
    find_pairs(rules_, scene);
    keep_list(lane);
  }

  void keep_list(int lane) {
    books_[lane].pairs = scratch_.scene.pairs;
    for (int b = 0; b < blocks_; ++b) {
      put(memory_.listed_x[b], lane, get(memory_.members[b].x, lane));
      put(memory_.listed_y[b], lane, get(memory_.members[b].y, lane));
    }
  }

  void settle_lane(std::int64_t step, int lane) {
    LaneBook& book = books_[lane];
    Scene& scene = scratch_.scene;
    fill_scene(rules_, memory_, lane, book.assemblies, scene);
    const std::int64_t row = book.world * out_.event_rows;
    scene.step = static_cast<std::int32_t>(step + 1 - book.first_step);
    scene.event_rows = out_.event_rows;
    scene.event_count = book.event_count;
    scene.event_step = out_.event_step + row;
    scene.event_block = out_.event_block + 2 * row;
    scene.event_face = out_.event_face + 2 * row;
    const PairList own = scene.pairs;
    if (listed_) {
      scene.pairs = book.pairs;
    } else {
      find_pairs(rules_, scene);
    }
    settle(rules_, scene);
    read_scene<Real, T>(rules_, scene, memory_, lane);
    book.event_count = scene.event_count;
    book.assemblies = scene.assemblies;
    if (scene.contact && book.first_contact < 0) {
      book.first_contact = scene.step;
    }
    if (listed_ && scene.rebuilt) {
      keep_list(lane);
    }
    scene.pairs = own;
    if (book.assemblies == 1 && blocks_ > 1 && out_.sample_every == 0) {
      next_event_ = step + 1;
    }
  }

  // `done` steps of the pack are over: samples are written and worlds that are over leave.
  void end_step(std::int64_t done) {
    if (out_.sample_every > 0) {
      for (int lane = 0; lane < lanes; ++lane) {
        const LaneBook& book = books_[lane];
        const std::int64_t own = done - book.first_step;
        if (book.running && own % out_.sample_every == 0) {
          write_moment<Real, T>(rules_, out_, memory_, lane, book.world, own / out_.sample_every);
        }
      }
    }
    if (done < next_event_) {
      return;
    }
    next_event_ = done + worlds_.steps;
    for (int lane = 0; lane < lanes; ++lane) {
      LaneBook& book = books_[lane];
      if (!book.running) {
        continue;
      }
      const std::int64_t own = done - book.first_step;
      const bool complete = book.assemblies == 1 && blocks_ > 1 && out_.sample_every == 0;
      if (complete || own == worlds_.steps) {
        write_results<Real, T>(run_, rules_, out_, memory_, lane, book, own);
        block_steps_ += own * blocks_;
        book.running = false;
      } else if (book.first_step + worlds_.steps < next_event_) {
        next_event_ = book.first_step + worlds_.steps;
      }
    }
  }

  const Prepared<T>& run_;
  const AssemblyRules& rules_;
  const AssemblyWorlds& worlds_;
  const AssemblyOutputs& out_;
  const WorldQueue& queue_;
  AssemblyScratch& scratch_;
  Node* blended_flow_;
  PackMemory<Real> memory_;
  NearRules<T> near_;
  int blocks_;
  bool listed_;
  Physics<Real, T> physics_;
  Philox<UInt> stream_;
  UInt draw_;
  LaneBook books_[lanes];
  bool empty_ = false;
  std::int64_t block_steps_ = 0;
  std::int64_t next_event_ = INT64_MAX; // no world is over before this many steps of the pack
};

DRIFTWALK_LANES_END
