"""Any function over many settings: order, work units, resume, executors."""

from driftwalk.core.files.shards import ShardStore
from driftwalk.sweep.design import Design, WorkUnit, grid, settings_per_unit, work_units
from driftwalk.sweep.run import MemoryStore, Store, SweepError, collect, run_sweep
from driftwalk.sweep.study import SweepStudy
from driftwalk.sweep.workers import WorkerExecutor, refuse_others, this_worker, threads_of_unit

__all__ = [
    "Design",
    "MemoryStore",
    "ShardStore",
    "Store",
    "SweepError",
    "SweepStudy",
    "WorkUnit",
    "WorkerExecutor",
    "collect",
    "grid",
    "refuse_others",
    "run_sweep",
    "settings_per_unit",
    "this_worker",
    "threads_of_unit",
    "work_units",
]
