"""Kinds of runs: the one table of them, and the contents of a run directory."""

from driftwalk.schema.runs.contents import RunContents, StoredRun, open_run_folder
from driftwalk.schema.runs.run_kinds import (
    RUN_KINDS,
    RunKind,
    answer_of,
    following_of,
    kind_of,
    kind_of_folder,
    load_maker,
    register,
    run_kind,
)

__all__ = [
    "RUN_KINDS",
    "RunContents",
    "RunKind",
    "StoredRun",
    "answer_of",
    "following_of",
    "kind_of",
    "kind_of_folder",
    "load_maker",
    "open_run_folder",
    "register",
    "run_kind",
]
