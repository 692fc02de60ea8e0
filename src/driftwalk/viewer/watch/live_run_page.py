"""Page of a run under way, for any kind of run."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, Protocol

from driftwalk.schema.runs import RUN_KINDS
from driftwalk.viewer.watch.shards import RunReader

Section = dict[str, Any]


class Running(Protocol):
    """A run that is under way."""

    title: str

    def look(self) -> list[Section]:
        """Read what is new, and return the sections that it changed."""

    def sections(self) -> list[Section]:
        """Return all sections as they are now."""

    def state(self) -> tuple[float | None, str]:
        """Return how far the run is, 0 to 1, and what is under way in words."""

    def cell(self, row: int, column: int) -> dict[str, Any]:
        """Return what is kept of a setting of the map."""


NO_CELL: Final[dict[str, Any]] = dict.fromkeys(
    (
        "excerpt_time",
        "excerpt_x",
        "excerpt_y",
        "density",
        "ks_step_length",
        "ks_turning_angle",
        "over_time",
    )
)
"""Answer for a setting that has not been simulated."""


class RunningOther:
    """A run of a kind that shows nothing before it is finished.

    Parameters
    ----------
    folder : Path
        The run directory.
    specification : mapping
        Everything that determines its numbers.
    """

    title = "A run under way"

    def __init__(self, folder: Path, specification: Mapping[str, Any]) -> None:
        self._reader = RunReader(folder)
        self._done = 0
        kind = RUN_KINDS.get(str(specification.get("kind")))
        if kind is not None:
            self.title = kind.under_way

    def look(self) -> list[Section]:
        """Count what is finished."""
        self._done += sum(1 for _ in self._reader.new_units())
        return []

    def sections(self) -> list[Section]:
        """Return one section that says that there is nothing to see yet."""
        reason = "This kind of run shows its results when it is finished. The page waits for it."
        return [
            {"id": "waiting", "kind": "empty", "title": self.title, "note": None, "reason": reason}
        ]

    def state(self) -> tuple[float | None, str]:
        """Return that nobody knows how far it is."""
        units = f": {self._done} work units are finished" if self._done else ""
        return None, f"under way{units}"

    def cell(self, row: int, column: int) -> dict[str, Any]:  # noqa: ARG002
        """Return nothing: there is no map."""
        return dict(NO_CELL)
