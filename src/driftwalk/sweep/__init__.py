"""Any function over many settings: order, work units, resume, executors."""

from driftwalk.core.shards import ShardStore
from driftwalk.sweep.design import Design, WorkUnit, grid
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
    "run_sweep",
]
