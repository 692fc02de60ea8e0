// Turns a BatchModel into what the kernels read, and owns it.
#pragma once

#include "driftwalk/simulate/prepared.hpp"

#include <vector>

namespace driftwalk {

template <class T>
class PreparedRun {
public:
  explicit PreparedRun(const BatchModel& model);
  PreparedRun(const PreparedRun&) = delete;
  PreparedRun& operator=(const PreparedRun&) = delete;

  const Prepared<T>& view() const { return view_; }
  // Numbers of scratch that SampleSink::blended_flow needs.
  std::int64_t blended_flow_size() const { return view_.frames > 1 ? view_.frame_size : 0; }

private:
  void prepare_wall(const BatchModel& model);
  void prepare_flow(const BatchModel& model);
  void prepare_samples(const BatchModel& model);
  void prepare_view(const BatchModel& model);

  Prepared<T> view_{};
  std::vector<PreparedEdge<T>> edges_;
  std::vector<PreparedEdge<T>> view_edges_;
  std::vector<typename FlowNumber<T>::type> table_;
  std::vector<double> frame_time_;
  std::vector<std::int64_t> sample_step_;
  std::vector<T> sample_weight_;
};

} // namespace driftwalk
