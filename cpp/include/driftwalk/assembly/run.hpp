// The loop of a pack of worlds with several blocks. A world that is over frees its lane for the
// next one in the queue.
#pragma once

#include "driftwalk/assembly/pack.hpp"

#include <numeric>

DRIFTWALK_LANES_BEGIN

template <class Real, class T, class Law, bool Crowded = Numbers<Real>::lanes == 1>
class AssemblyPack {
public:
  static constexpr int lanes = WorldPack<Real, T, Law, Crowded>::worlds;

  AssemblyPack(const Prepared<T>& run, const AssemblyRules& rules, const AssemblyWorlds& worlds,
               const AssemblyOutputs& out, const WorldQueue& queue, AssemblyScratch& scratch)
      : run_(run), rules_(rules), worlds_(worlds), out_(out), queue_(queue),
        pack_(run, rules, worlds.start, out, scratch, rules.blocks),
        ends_(out.sample_every == 0 && !rules.bonds_break) {}

  // Returns the number of block-steps of the worlds that were run.
  std::int64_t run() {
    // Lanes take a new world where a block of random numbers begins, and a cycle of distant pulls.
    const std::int64_t period = std::lcm(pack_.period(), rules_.pull.every);
    for (std::int64_t step = 0;; ++step) {
      if (step % period == 0 && !refill(step)) {
        return block_steps_;
      }
      if (pack_.step(step) && ends_) {
        next_event_ = step + 1;
      }
      end_step(step + 1);
    }
  }

private:
  // False when no lane has a world any more.
  bool refill(std::int64_t step) {
    bool some = false;
    for (int lane = 0; lane < lanes; ++lane) {
      some = some || pack_.book(lane).running;
    }
    for (int lane = 0; lane < lanes; ++lane) {
      if (!pack_.book(lane).running && !empty_) {
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
    pack_.begin(lane, world, step, worlds_.start + 3 * rules_.blocks * world, worlds_.key[world],
                worlds_.flow_start == nullptr ? 0.0 : worlds_.flow_start[world]);
    pack_.set_forces(lane, worlds_.drag_coefficient[world], worlds_.force_std[world]);
    if (out_.sample_every > 0) {
      write_moment<Real, T>(rules_, out_, pack_.memory(), lane, world, 0);
    }
    next_event_ = next_event_ < step + worlds_.steps ? next_event_ : step + worlds_.steps;
  }

  // `done` steps of the pack are over: samples are written and worlds that are over leave.
  void end_step(std::int64_t done) {
    if (out_.sample_every > 0) {
      for (int lane = 0; lane < lanes; ++lane) {
        const LaneBook& book = pack_.book(lane);
        const std::int64_t own = done - book.first_step;
        if (book.running && own % out_.sample_every == 0) {
          write_moment<Real, T>(rules_, out_, pack_.memory(), lane, book.world,
                                own / out_.sample_every);
        }
      }
    }
    if (done < next_event_) {
      return;
    }
    next_event_ = done + worlds_.steps;
    for (int lane = 0; lane < lanes; ++lane) {
      LaneBook& book = pack_.book(lane);
      if (!book.running) {
        continue;
      }
      const std::int64_t own = done - book.first_step;
      const bool complete = book.assemblies == 1 && rules_.blocks > 1 && ends_;
      if (complete || own == worlds_.steps) {
        write_results<Real, T>(run_, rules_, out_, pack_.memory(), lane, book, own);
        block_steps_ += own * rules_.blocks;
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
  WorldPack<Real, T, Law, Crowded> pack_;
  bool ends_; // whether a world is over when it has become one assembly
  bool empty_ = false;
  std::int64_t block_steps_ = 0;
  std::int64_t next_event_ = INT64_MAX; // no world is over before this many steps of the pack
};

DRIFTWALK_LANES_END
