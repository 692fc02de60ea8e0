// Turns a BatchModel into what the kernels read, and owns it.
#pragma once

#include "driftwalk/simulate/prepared.hpp"

#include <vector>

namespace driftwalk {

// Where the nodes of a flow are in its tables: so many rows of `columns` records, the first of the
// flow's own in row `bottom` and column `left`.
struct TableGrid {
  int left, bottom;
  int rows, columns;
  int own_rows, own_columns;

  std::int64_t own_nodes() const { return std::int64_t(own_rows) * own_columns; }
};

// Velocities of the flow's own nodes, or accelerations, as a table in units of `step`: one record
// per node; beyond the grid the nearest node's value goes on.
template <class T>
void write_table(const TableGrid& grid, const double* u, const double* v, double step,
                 typename FlowNumber<T>::type* out);
// The step of a table whose largest number is `largest`, and the unit of what is looked up in it:
// the float kernel's four weights sum to 32767.
double table_step(double largest);
template <class T>
T table_unit(double step);

template <class T>
class PreparedRun {
public:
  explicit PreparedRun(const BatchModel& model);
  PreparedRun(const PreparedRun&) = delete;
  PreparedRun& operator=(const PreparedRun&) = delete;

  const Prepared<T>& view() const { return view_; }

private:
  void prepare_shape(const BatchModel& model);
  void prepare_wall(const BatchModel& model);
  void prepare_flow(const BatchModel& model);
  void prepare_water(const BatchModel& model, const TableGrid& grid);
  void prepare_force(const BatchModel& model);
  void prepare_samples(const BatchModel& model);
  void prepare_view(const BatchModel& model);

  Prepared<T> view_{};
  std::vector<Panel<T>> panels_;
  std::vector<AreaPoint<T>> points_;
  std::vector<Corner<T>> corners_;
  std::vector<PreparedEdge<T>> edges_;
  std::vector<PreparedEdge<T>> view_edges_;
  std::vector<typename FlowNumber<T>::type> table_, water_;
  std::vector<double> frame_time_;
  std::vector<std::int64_t> sample_step_;
  std::vector<T> sample_weight_;
};

} // namespace driftwalk
