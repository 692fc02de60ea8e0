// The worlds of a pack and one time step of all of them. Nothing a world does depends on its lane
// or its neighbours. A pack of many blocks (`Crowded`) is one world.
#pragma once

#include "driftwalk/assembly/bond_load.hpp"
#include "driftwalk/assembly/correlate.hpp"
#include "driftwalk/assembly/kept_world.hpp"
#include "driftwalk/assembly/lane.hpp"
#include "driftwalk/assembly/near.hpp"
#include "driftwalk/assembly/walls.hpp"
#include "driftwalk/random/stirring.hpp"
#include "driftwalk/simulate/run.hpp"

DRIFTWALK_LANES_BEGIN

template <class Real, class T, class Law, bool Crowded = Numbers<Real>::lanes == 1>
class WorldPack {
public:
  static constexpr int lanes = Numbers<Real>::lanes;
  static constexpr int worlds = Crowded ? 1 : lanes;
  using Bool = typename Numbers<Real>::Bool;
  using UInt = typename Numbers<Real>::UInt;

  // All lanes get the blocks at `start`; those that never begin move them along for nothing. The
  // memory holds worlds of up to `capacity` blocks. Events go to `out`.
  WorldPack(const Prepared<T>& run, const AssemblyRules& rules, const double* start,
            const AssemblyOutputs& out, AssemblyScratch& scratch, int capacity)
      : run_(run), rules_(rules), out_(out), scratch_(scratch),
        memory_(scratch.lanes, capacity, Crowded), near_(rules), blocks_(rules.blocks),
        rows_(memory_.rows(rules.blocks)), listed_(Crowded && rules.blocks > most_blocks_all_pairs),
        physics_{Law::of(Real(T(0)), run.drag),
                 run.block,
                 run.shape,
                 run.flow,
                 run.water,
                 run.wall,
                 run.step,
                 {Real(T(0)), Real(T(0)), Real(T(0))},
                 static_cast<T>(rules.hidden_share),
                 rules.pull.on} {
    for (int lane = 0; lane < lanes; ++lane) {
      if (lane < worlds) {
        load_lane<Real, T>(rules_, start, memory_, lane);
        // One assembly until its world begins: blocks of a lane without a world pull at nothing,
        // and no water reaches them.
        for (int b = 0; b < blocks_ && !Crowded; ++b) {
          put(memory_.members[b].root, lane, 0);
          for (auto& face : memory_.members[b].covered) {
            put(face, lane, true);
          }
        }
        const int bonds = bond_room(capacity);
        books_[lane].bonds = {memory_.bonds + bonds * lane, 0, bonds};
      }
      put(stream_.key0, lane, 0);
      put(stream_.key1, lane, 0);
      put(draw_, lane, 0);
      put(first_numbers_, lane, Crowded ? lane : 0);
      begin_force(lane);
    }
    if (run_.frames > 1) {
      clocks_.show(physics_.flow, physics_.water);
    }
  }

  const PackMemory<Real>& memory() const { return memory_; }
  LaneBook& book(int lane) { return books_[lane]; }
  const LaneBook& book(int lane) const { return books_[lane]; }

  // Steps that one block of random numbers serves: two force intervals.
  std::int64_t period() const { return 2 * std::int64_t(run_.steps_per_interval); }

  // Puts a world into a lane, or one of many blocks into all, before the pack's step `step`, a
  // whole number of periods.
  void begin(int own, std::int64_t world, std::int64_t step, const double* start, std::uint64_t key,
             double flow_start) {
    LaneBook& book = books_[own];
    book.world = world;
    book.first_step = step;
    book.event_count = 0;
    book.first_contact = -1;
    book.assemblies = blocks_;
    book.running = true;
    book.key = key;
    book.bonds.count = 0;
    load_lane<Real, T>(rules_, start, memory_, own);
    if (rules_.glued > 1) {
      glue(own);
    }
    begin_stream(own, key, flow_start);
    for (int lane = own; lane < end_of(own); ++lane) {
      put(draw_, lane, 0);
      begin_force(lane);
    }
    list_crowd();
  }

  // Makes assemblies of the blocks of a world that has begun.
  void join(int own, const LiveBlocks& joined) {
    Scene& scene = scratch_.scene;
    fill_scene(rules_, memory_, own, blocks_, scene);
    join_blocks(rules_, scene, joined);
    read_scene(rules_, scene, memory_, own);
    books_[own].assemblies = scene.assemblies;
    if (rules_.bonds_break) {
      bond_anew(0, own);
    }
    list_crowd();
  }

  void keep(int own, char* state) const { keep_world(rules_, memory_, own, books_[own], state); }

  // Goes on, from the pack's step `step`, with a world that has been kept at that step of its own.
  void resume(int own, std::int64_t world, std::int64_t step, std::uint64_t key, double flow_start,
              const char* state) {
    LaneBook& book = books_[own];
    book.world = world;
    book.first_step = 0;
    book.event_count = 0;
    book.running = true;
    book.key = key;
    resume_world(rules_, memory_, own, book, state);
    begin_stream(own, key, flow_start);
    const std::int64_t draws = (step + period() - 1) / period();
    for (int lane = own; lane < end_of(own); ++lane) {
      put(draw_, lane, static_cast<UInt32>(draws));
      if (draws > 0) {
        put(kept_, lane, run_.force_kept);
        put(fresh_, lane, T(1) - run_.force_kept);
      }
    }
    list_crowd();
  }

  void set_forces(int own, double drag_coefficient, double force_std) {
    const WorldConstants<T> found = world_constants(
        physics_.law, run_, static_cast<T>(drag_coefficient), static_cast<T>(force_std));
    for (int lane = own; lane < end_of(own); ++lane) {
      put_drag_coefficient(physics_.law, lane, drag_coefficient);
      put(physics_.world.drag_per_mass, lane, found.drag_per_mass);
      put(physics_.world.drag_per_inertia, lane, found.drag_per_inertia);
      put(physics_.world.noise_scale, lane, found.noise_scale);
    }
  }

  // For all worlds: the flow times a factor.
  void scale_flow(T factor) {
    physics_.flow.unit = run_.flow.unit * factor;
    physics_.water.strength = factor;
    physics_.water.part = factor * factor;
  }

  // To be called when the rules, or the blocks of a lane, have been changed from outside.
  void renew() {
    near_ = NearRules<T>(rules_);
    physics_.hidden_share = static_cast<T>(rules_.hidden_share);
    physics_.pulled = rules_.pull.on;
    blocks_ = rules_.blocks;
    rows_ = memory_.rows(blocks_);
    listed_ = Crowded && blocks_ > most_blocks_all_pairs;
    list_crowd();
  }

  // Bonds all neighbours of a lane anew, when they begin to break or blocks have come or gone.
  void bond_anew(std::int64_t step, int lane) {
    bond_all(rules_, open_scene(step, lane));
    books_[lane].bonds = scratch_.scene.bonds;
  }

  // The normal numbers that a block has in the period under way. A force that remembers begins
  // anew.
  void draw_again(int block) {
    draw_forces(block, draw_ - UInt(static_cast<UInt32>(1)), Real(T(0)), Real(run_.force_first));
  }

  // One time step of every lane; returns whether a world has become one assembly in it.
  bool step(std::int64_t step) {
    const std::int64_t phase = step % period();
    if (phase == 0) {
      draw_all_forces();
      kept_ = Real(run_.force_kept);
      fresh_ = Real(T(1) - run_.force_kept);
      draw_ = draw_ + UInt(static_cast<UInt32>(1));
    }
    if (run_.frames > 1) {
      look_at_flow(step);
    }
    const int half = phase < run_.steps_per_interval ? 0 : 1;
    const auto pull = [this, step] { feel_pull(step); };
    if constexpr (Crowded) {
      const auto sum = [&]<int Count>() { sum_crowd<Count>(memory_.crowd, memory_.sums, rows_); };
      advance(physics_, half, memory_.members, memory_.sums, rows_, sum, pull);
      meet_walls(physics_, memory_.members, memory_.crowd, rows_);
    } else {
      const auto sum = [&]<int Count>() {
        sum_masked<Count>(memory_.members, memory_.sums, blocks_);
      };
      advance(physics_, half, memory_.members, memory_.sums, blocks_, sum, pull);
      meet_walls(physics_, memory_.members, blocks_);
    }
    if (rules_.bonds_break) {
      break_worlds(step, half);
    }
    return settle_lanes(step);
  }

private:
  void glue(int own) {
    Scene& scene = scratch_.scene;
    fill_scene(rules_, memory_, own, blocks_, scene);
    glue_blocks(rules_, scene);
    read_scene(rules_, scene, memory_, own);
    books_[own].assemblies = scene.assemblies;
  }

  void begin_stream(int own, std::uint64_t key, double flow_start) {
    for (int lane = own; lane < end_of(own); ++lane) {
      put(stream_.key0, lane, static_cast<UInt32>(key));
      put(stream_.key1, lane, static_cast<UInt32>(key >> 32));
      clocks_.begin(lane, flow_start);
    }
  }

  void feel_pull(std::int64_t step) {
    if (!rules_.pull.on) {
      return;
    }
    const bool whole = rules_.pull.is_whole(step);
    const Member<Real>* const members = memory_.members;
    Pulled<Real>* const pulled = memory_.pulled;
    for (int row = 0; row < rows_; ++row) {
      look_at(physics_, members[row], pulled[row]);
    }
    if constexpr (Crowded) {
      pull_crowd(rules_.pull, whole, members, pulled, blocks_,
                 listed_ ? &scratch_.scene.pairs : nullptr);
    } else {
      pull_all(rules_.pull, whole, members, pulled, blocks_);
    }
    for (int row = 0; row < rows_; ++row) {
      add_pull(physics_, run_, members[row], pulled[row], memory_.sums[row]);
    }
  }

  // The first force of a world has no last one to remember, and the spread of all that follow.
  void begin_force(int lane) {
    put(kept_, lane, 0);
    put(fresh_, lane, run_.force_first);
  }

  // The lane after the last of a world.
  static constexpr int end_of(int own) { return Crowded ? lanes : own + 1; }

  void draw_all_forces() {
    const bool few = rules_.stirring_length > 0 && blocks_ <= most_blocks_correlated;
    Real last[most_blocks_correlated][2];
    for (int b = 0; b < rows_; ++b) {
      if (few) {
        last[b][0] = memory_.members[b].normals[2];
        last[b][1] = memory_.members[b].normals[3];
        draw_fresh(b, draw_);
      } else {
        draw_forces(b, draw_, kept_, fresh_);
      }
    }
    if (few) {
      correlate(static_cast<T>(rules_.stirring_length), rules_.incompressible, blocks_,
                memory_.members);
    }
    for (int b = 0; b < blocks_ && few; ++b) {
      remember_forces(last[b], kept_, fresh_, memory_.members[b].normals);
    }
  }

  // `kept` and `fresh` are of the first interval of the period.
  void draw_forces(int row, UInt draw, Real kept, Real fresh) {
    Real* const normals = memory_.members[row].normals;
    const Real last[2] = {normals[2], normals[3]};
    draw_fresh(row, draw);
    remember_forces(last, kept, fresh, normals);
  }

  void remember_forces(const Real* last, Real kept, Real fresh, Real* normals) const {
    if (run_.force_kept > T(0)) {
      remember(kept, fresh, last, normals);
      remember(Real(run_.force_kept), Real(T(1) - run_.force_kept), normals, normals + 2);
    }
  }

  // The normal numbers of a row of blocks in two intervals, without memory.
  void draw_fresh(int row, UInt draw) {
    const UInt32 first = static_cast<UInt32>(Crowded ? row * lanes : row);
    Member<Real>& m = memory_.members[row];
    Real* const normals = m.normals;
    if (rules_.stirring_length > 0 && blocks_ > most_blocks_correlated) {
      const T length = static_cast<T>(rules_.stirring_length);
      if (rules_.incompressible) {
        draw_stirring<IncompressibleStirring>(stream_, draw, length, m.x, m.y, normals);
      } else {
        draw_stirring<FreeStirring>(stream_, draw, length, m.x, m.y, normals);
      }
    } else {
      UInt words[4];
      stream_(draw, first_numbers_ + UInt(first), UInt(static_cast<UInt32>(0)),
              UInt(static_cast<UInt32>(Purpose::force)), words);
      normal_pair(words[0], words[1], normals[0], normals[1]);
      normal_pair(words[2], words[3], normals[2], normals[3]);
    }
  }

  void look_at_flow(std::int64_t step) {
    for (int lane = 0; lane < lanes; ++lane) {
      const LaneBook& book = books_[Crowded ? 0 : lane];
      const std::int64_t own = book.running ? step - book.first_step : 0;
      const double middle = (static_cast<double>(own) + 0.5) * static_cast<double>(run_.step.dt);
      clocks_.look(run_, lane, middle, physics_.water.strength);
    }
  }

  bool settle_lanes(std::int64_t step) {
    bool complete = false;
    if constexpr (Crowded) {
      if (listed_) {
        if (!books_[0].running) {
          return false;
        }
        renew_list();
        return is_to_settle(near_, memory_.members, memory_.crowd, scratch_.scene.pairs) &&
               settle_lane(step, 0);
      }
    }
    const Bool unsettled = lanes_to_settle(near_, memory_.members, blocks_);
    if (any(unsettled)) {
      for (int lane = 0; lane < worlds; ++lane) {
        if (books_[lane].running && lane_of(unsettled, lane)) {
          complete = settle_lane(step, lane) || complete;
        }
      }
    }
    return complete;
  }

  // The list of near pairs reaches half a skin beyond what touches on either side.
  void renew_list() {
    const Crowd<Real>& crowd = memory_.crowd;
    const Real limit{
        static_cast<T>(0.25 * pair_skin_sides * pair_skin_sides * rules_.side * rules_.side)};
    for (int row = 0; row < rows_; ++row) {
      const Real dx = crowd.x[row] - crowd.listed_x[row];
      const Real dy = crowd.y[row] - crowd.listed_y[row];
      // What fills the last row moves too, and does not count.
      const auto real = as_signed(first_numbers_) < Int32(blocks_ - row * lanes);
      if (any((dx * dx + dy * dy > limit) & real)) {
        list_pairs();
        return;
      }
    }
  }

  void list_pairs() {
    fill_scene(rules_, memory_, 0, books_[0].assemblies, scratch_.scene);
    find_pairs(rules_, scratch_.scene);
    keep_list();
  }

  void keep_list() {
    for (int row = 0; row < rows_; ++row) {
      memory_.crowd.listed_x[row] = memory_.members[row].x;
      memory_.crowd.listed_y[row] = memory_.members[row].y;
    }
  }

  // To be called when the blocks of a world, or the assemblies that they are part of, have changed.
  void list_crowd() {
    if constexpr (Crowded) {
      memory_.crowd.list_bodies(memory_.members, blocks_);
      if (listed_) {
        list_pairs();
      }
    }
  }

  void break_worlds(std::int64_t step, int half) {
    for (int own = 0; own < worlds; ++own) {
      if (books_[own].running && wear_bonds(rules_, physics_, run_.mass, half, memory_, own,
                                            books_[own].bonds, scratch_.scene.cell_next)) {
        driftwalk::break_bonds(rules_, open_scene(step, own));
        close_scene(own);
        list_crowd();
      }
    }
  }

  // The lane's world in plain numbers, and where its events go.
  Scene& open_scene(std::int64_t step, int lane) {
    const LaneBook& book = books_[lane];
    Scene& scene = scratch_.scene;
    fill_scene(rules_, memory_, lane, book.assemblies, scene);
    const std::int64_t row = book.world * out_.event_rows;
    scene.step = static_cast<std::int32_t>(step + 1 - book.first_step);
    scene.key = book.key;
    scene.bonds = book.bonds;
    scene.event_rows = out_.event_rows;
    scene.event_count = book.event_count;
    scene.event_step = out_.event_step + row;
    scene.event_kind = rules_.bonds_break ? out_.event_kind + row : nullptr;
    scene.event_block = out_.event_block + 2 * row;
    scene.event_face = out_.event_face + 2 * row;
    return scene;
  }

  void close_scene(int lane) {
    LaneBook& book = books_[lane];
    const Scene& scene = scratch_.scene;
    read_scene(rules_, scene, memory_, lane);
    book.bonds = scene.bonds;
    book.event_count = scene.event_count;
    if (Crowded && book.assemblies != scene.assemblies) {
      memory_.crowd.list_bodies(memory_.members, blocks_);
    }
    book.assemblies = scene.assemblies;
  }

  // Returns whether the world is one assembly now.
  bool settle_lane(std::int64_t step, int lane) {
    LaneBook& book = books_[lane];
    Scene& scene = open_scene(step, lane);
    if (!listed_) {
      find_pairs(rules_, scene);
    }
    settle(rules_, scene);
    close_scene(lane);
    if (scene.contact && book.first_contact < 0) {
      book.first_contact = scene.step;
    }
    if (listed_ && scene.rebuilt) {
      keep_list();
    }
    return book.assemblies == 1 && blocks_ > 1;
  }

  const Prepared<T>& run_;
  const AssemblyRules& rules_;
  const AssemblyOutputs& out_;
  AssemblyScratch& scratch_;
  PackMemory<Real> memory_;
  NearRules<T> near_;
  int blocks_;
  int rows_;
  bool listed_; // there is a list of near pairs
  Physics<Real, T, Law> physics_;
  Philox<UInt> stream_;
  UInt draw_;
  UInt first_numbers_; // of a world's blocks, those of the first row
  Real kept_, fresh_;  // parts of the last force and of the new numbers in the next force
  LaneBook books_[worlds];
  FlowClocks<T> clocks_;
};

DRIFTWALK_LANES_END
