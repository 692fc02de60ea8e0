"""Any function over many settings: order, work units, resume, executors."""

from driftwalk.core.shards import ShardStore
from driftwalk.sweep.design import Design, WorkUnit, grid
from driftwalk.sweep.handout import threads_of_unit
from driftwalk.sweep.remote import refuse_others
from driftwalk.sweep.run import SweepError, run_sweep
from driftwalk.sweep.store import MemoryStore, Store, collect

__all__ = [
    "Design",
    "MemoryStore",
    "ShardStore",
    "Store",
    "SweepError",
    "WorkUnit",
    "collect",
    "grid",
    "refuse_others",
    "run_sweep",
    "threads_of_unit",
]
