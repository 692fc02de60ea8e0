// The worlds of a group through some time steps: from what is kept of them and back to it.
#pragma once

#include "driftwalk/assembly/pack.hpp"

DRIFTWALK_LANES_BEGIN

inline LiveBlocks rows_from(const LiveBlocks& blocks, std::int64_t row) {
  return {blocks.pose + 3 * row, blocks.velocity + 3 * row, blocks.assembly + row,
          blocks.cell + 2 * row, blocks.quarter + row,      blocks.kind + row};
}

template <class Real, class T, class Law, bool Crowded>
class TankPack {
public:
  // The room for events is that of the group.
  TankPack(const Prepared<T>& run, const AssemblyRules& rules, const TankGroup& group,
           AssemblyScratch& scratch)
      : run_(run), rules_(rules), group_(group),
        pack_(run, rules, blocks_of(0).pose, group.events, scratch, rules.blocks) {}

  void run() {
    for (int own = 0; own < group_.count; ++own) {
      begin(own);
    }
    pack_.scale_flow(static_cast<T>(group_.flow_scale));
    for (std::int64_t step = group_.step; step < group_.step + group_.steps; ++step) {
      pack_.step(step);
      for (int own = 0; own < group_.count; ++own) {
        if (pack_.book(own).event_count > 0) {
          note_events(own);
        }
      }
    }
    for (int own = 0; own < group_.count; ++own) {
      const std::int64_t world = group_.world[own];
      pack_.keep(own, state_of(world));
      read_blocks<Real, T>(rules_, pack_.memory(), own, blocks_of(own));
      group_.status[world] = lane_status<Real, T>(run_, rules_, pack_.memory(), own);
    }
  }

private:
  using Pack = WorldPack<Real, T, Law, Crowded>;

  LiveBlocks blocks_of(int own) const {
    return rows_from(group_.now, group_.world[own] * rules_.blocks);
  }
  char* state_of(std::int64_t world) const {
    return group_.state + static_cast<std::int64_t>(KeptLayout<Real>::bytes(rules_.blocks)) * world;
  }

  void begin(int own) {
    const std::int64_t world = group_.world[own];
    const std::uint64_t key = group_.key[world];
    const double flow_start = group_.flow_start == nullptr ? 0.0 : group_.flow_start[world];
    if (!group_.begins) {
      pack_.resume(own, own, group_.step, key, flow_start, state_of(world));
    } else {
      pack_.begin(own, own, group_.step, blocks_of(own).pose, key, flow_start);
      if (group_.joined != nullptr) {
        pack_.join(own, rows_from(*group_.joined, world * rules_.blocks));
      }
    }
    pack_.set_forces(own, group_.drag_coefficient[world], group_.force_std[world]);
  }

  void note_events(int own) {
    const AssemblyOutputs& events = group_.events;
    LaneBook& book = pack_.book(own);
    for (int e = 0; e < book.event_count; ++e) {
      const std::int64_t row = std::int64_t(own) * events.event_rows + e;
      if (!rules_.bonds_break ||
          events.event_kind[row] <= static_cast<std::int32_t>(EventKind::parting)) {
        group_.last_event[group_.world[own]] = events.event_step[row];
      }
    }
    book.event_count = 0;
  }

  const Prepared<T>& run_;
  const AssemblyRules& rules_;
  const TankGroup& group_;
  Pack pack_;
};

template <class Real, class T>
inline void run_group(const Prepared<T>& run, const AssemblyRules& rules, const TankGroup& group,
                      AssemblyScratch& scratch) {
  const auto run_by = [&]<class Law>() {
    if (PackMemory<Real>::is_one_world(rules.blocks)) {
      TankPack<Real, T, Law, true>(run, rules, group, scratch).run();
    } else {
      TankPack<Real, T, Law, false>(run, rules, group, scratch).run();
    }
  };
  if (run.drag.is_quadratic) {
    run_by.template operator()<QuadraticDrag>();
  } else {
    run_by.template operator()<MixedDrag<Real>>();
  }
}

DRIFTWALK_LANES_END
