// A batch of worlds that keep their state: which of them go on together.
#include "driftwalk/assembly/tank_batch.hpp"

#include "driftwalk/assembly/memory.hpp"
#include "driftwalk/dispatch.hpp"
#include "driftwalk/simulate/threads.hpp"

#include <algorithm>
#include <cstring>
#include <tuple>

namespace driftwalk {

namespace {
// Room for the events of one step of a pack. A block has four bonds.
class EventRoom {
public:
  EventRoom(int blocks, int lanes)
      : rows_(8 * blocks), one_(static_cast<std::size_t>(lanes) * rows_), kind_(one_),
        block_(2 * one_.size()), face_(block_) {}
  AssemblyOutputs outputs() {
    AssemblyOutputs out;
    out.event_rows = rows_;
    out.event_step = one_.data();
    out.event_kind = kind_.data();
    out.event_block = block_.data();
    out.event_face = face_.data();
    return out;
  }

private:
  int rows_;
  std::vector<std::int32_t> one_, kind_, block_, face_;
};

// Worlds in the order of their packs, and where each pack begins.
struct Packs {
  std::vector<std::int64_t> world;
  std::vector<std::size_t> begin;

  Packs(const TankSettings& settings, std::int64_t worlds, int lanes) {
    for (std::int64_t w = 0; w < worlds; ++w) {
      if (settings.flow[w] >= 0) {
        world.push_back(w);
      }
    }
    const auto group = [&](std::int64_t w) {
      return std::tuple(settings.flow[w], settings.latching[w], settings.flow_scale[w]);
    };
    std::sort(world.begin(), world.end(), [&](std::int64_t a, std::int64_t b) {
      return std::tuple(group(a), a) < std::tuple(group(b), b);
    });
    for (std::size_t k = 0; k < world.size(); ++k) {
      if (begin.empty() || k - begin.back() == static_cast<std::size_t>(lanes) ||
          group(world[k]) != group(world[k - 1])) {
        begin.push_back(k);
      }
    }
    begin.push_back(world.size());
  }
};

// Rows of some worlds, of an array with as many numbers for each.
template <class T>
std::vector<T> rows_of(const std::vector<T>& from, const std::vector<std::int64_t>& world,
                       std::size_t worlds) {
  const std::size_t width = from.size() / worlds;
  std::vector<T> rows(width * world.size());
  for (std::size_t k = 0; k < world.size(); ++k) {
    std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(width) * world[k], width,
                rows.begin() + static_cast<std::ptrdiff_t>(width * k));
  }
  return rows;
}
} // namespace

TankBatch::TankBatch(std::vector<TankFlow> flows, std::vector<std::uint64_t> key,
                     const double* start, const LiveBlocks* joined, int threads)
    : flows_(std::move(flows)), kernels_(DRIFTWALK_CHOSEN(tank_kernels_)), key_(std::move(key)) {
  const std::size_t worlds = key_.size(), rows = worlds * static_cast<std::size_t>(blocks());
  const bool twice = flows_.front().twice != nullptr;
  const auto kept_bytes = twice ? kernels_.twice.kept_bytes : kernels_.single.kept_bytes;
  state_.resize(worlds * kept_bytes(blocks()));
  pose_.assign(start, start + 3 * rows);
  velocity_.resize(3 * rows);
  assembly_.resize(rows);
  cell_.resize(2 * rows);
  quarter_.resize(rows);
  kind_.resize(rows);
  status_.resize(worlds);
  last_event_.resize(worlds);
  const std::vector<std::int32_t> none(worlds);
  const std::vector<double> nothing(worlds);
  TankGroup group;
  group.begins = true;
  LiveBlocks given{};
  if (joined != nullptr) {
    given = *joined;
    given.pose = pose_.data();
    group.joined = &given;
  }
  run({none.data(), none.data(), nothing.data(), nothing.data(), nothing.data()}, group, threads);
}

LiveBlocks TankBatch::now() {
  return {pose_.data(), velocity_.data(), assembly_.data(),
          cell_.data(), quarter_.data(),  kind_.data()};
}

void TankBatch::advance(const TankSettings& settings, std::int64_t steps, int threads) {
  TankGroup group;
  group.step = step_;
  group.steps = steps;
  run(settings, group, threads);
  step_ += steps;
}

void TankBatch::run(const TankSettings& settings, TankGroup group, int threads) {
  group.key = key_.data();
  group.drag_coefficient = settings.drag_coefficient;
  group.force_std = settings.force_std;
  group.state = state_.data();
  group.now = now();
  group.status = status_.data();
  group.last_event = last_event_.data();
  const auto run_packs = [&](const auto& kernel, const auto& run_of) {
    const Packs packs(settings, worlds(), blocks() > most_blocks_all_pairs ? 1 : kernel.lanes);
    run_tasks(static_cast<std::int64_t>(packs.begin.size()) - 1, threads, [&] {
      return
          [&, memory = std::make_unique<AssemblyMemory>(blocks(), kernel.scratch_bytes(blocks())),
           room = EventRoom(blocks(), kernel.lanes)](std::int64_t pack) mutable {
            const std::size_t begin = packs.begin[static_cast<std::size_t>(pack)];
            const std::size_t end = packs.begin[static_cast<std::size_t>(pack) + 1];
            const std::int64_t first = packs.world[begin];
            const TankFlow& flow = flows_[static_cast<std::size_t>(settings.flow[first])];
            AssemblyRules rules = flow.rules;
            rules.latching = static_cast<Latching>(settings.latching[first]);
            TankGroup own = group;
            own.flow_scale = settings.flow_scale[first];
            own.world = packs.world.data() + begin;
            own.count = static_cast<int>(end - begin);
            own.flow_start = flow.start.empty() ? nullptr : flow.start.data();
            own.events = room.outputs();
            kernel.go_on(run_of(flow), rules, own, memory->scratch());
          };
    });
  };
  if (flows_.front().twice != nullptr) {
    run_packs(kernels_.twice, [](const TankFlow& flow) -> auto& { return flow.twice->view(); });
  } else {
    run_packs(kernels_.single, [](const TankFlow& flow) -> auto& { return flow.single->view(); });
  }
}

TankBatch TankBatch::take(const std::vector<std::int64_t>& world,
                          std::vector<std::uint64_t> key) const {
  const std::size_t all = key_.size();
  TankBatch taken;
  taken.flows_ = flows_;
  taken.kernels_ = kernels_;
  for (TankFlow& flow : taken.flows_) {
    flow.start = rows_of(flow.start, world, all);
  }
  taken.key_ = std::move(key);
  taken.step_ = step_;
  taken.state_ = rows_of(state_, world, all);
  taken.pose_ = rows_of(pose_, world, all);
  taken.velocity_ = rows_of(velocity_, world, all);
  taken.assembly_ = rows_of(assembly_, world, all);
  taken.cell_ = rows_of(cell_, world, all);
  taken.quarter_ = rows_of(quarter_, world, all);
  taken.kind_ = rows_of(kind_, world, all);
  taken.last_event_ = rows_of(last_event_, world, all);
  taken.status_ = rows_of(status_, world, all);
  return taken;
}

} // namespace driftwalk
