"""`driftwalk watch`: who is joined to whom, live."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from driftwalk.cli.options.flatten_options import with_options
from driftwalk.cli.options.shared_types import Replace, optional
from driftwalk.cli.options.tracking import TrackingOptions
from driftwalk.cli.terminal.output import print_note, print_warnings, printable
from driftwalk.core.errors import InputError

if TYPE_CHECKING:
    from driftwalk.track import AssemblySeen, Frame, TrackState

_MOST_CLASSES = 6
"""Classes that a message names before it counts the others; one line of a terminal holds them."""


@with_options(
    TrackingOptions,
    *("source", "markers", "bodies", "side", "camera", "tank", "scale", "fps"),
    *("max_speed", "lost_after", "live", "live_nmea", "live_host", "overlay"),
)
def watch(
    options: TrackingOptions,
    out: Path | None = optional("--out -o FILE.nc", "Recording to write as well."),
    overwrite: Replace = False,
) -> None:
    """Watch blocks assemble: poses, joins and the outcome class, as they happen.

    Prints a line for each join, parting or change of the class, and one line per second with the
    poses. While a block is hidden, lists the classes that are still possible.
    """
    from driftwalk.cli.recordings.track import TrackingRun
    from driftwalk.cli.recordings.tracking_parts import build_parts
    from driftwalk.core.files.atomic import require_free, require_target

    existing = "replace" if overwrite else "error"
    if out is not None:
        require_target(out, existing=existing, endings=(".nc",))
    if options.overlay is not None:
        require_free(options.overlay, existing=existing)
    parts = build_parts(options)
    if parts.observer is None:
        raise InputError(
            "to report which blocks are joined, watch needs markers with an "
            "orientation, the number of blocks (--bodies) and their side (--side, or "
            "block_side_m in the markers file)"
        )
    run = TrackingRun(options, parts, out, _Printer())
    run.run()
    if out is not None and not run.saved:
        run.recording()  # Says that nothing was tracked, and what was there instead.
    if run.saved:
        print_note(f"wrote {out}")
    print_warnings([run.interrupted])


class _Printer:
    """Prints what changes, and the poses and the frames dropped once a second."""

    def __init__(self) -> None:
        self._class: frozenset[str] | None = None
        self._next = self._next_dropped = 0.0
        self._dropped = 0

    def __call__(
        self,
        frame: Frame,
        states: Sequence[TrackState],
        observed: AssemblySeen | None,
        dropped: int,
    ) -> None:
        if dropped > self._dropped and frame.time >= self._next_dropped:
            # A camera that is too fast drops some at every frame.
            self._next_dropped = frame.time + 1.0
            _say(frame.time, "dropped", f"{dropped - self._dropped} ({dropped} up to now)")
            self._dropped = dropped
        if observed is None:
            return
        for event in observed.events:
            faces = zip(event.bodies, event.faces, strict=True)
            between = " - ".join(f"{body}:{face}" for body, face in faces)
            _say(event.time, event.kind, between, event.outcome)
        if observed.possible != self._class:
            self._class = observed.possible
            hidden = f"  (hidden: {', '.join(observed.hidden)})" if observed.hidden else ""
            _say(frame.time, "class", f"{_classes(observed)}{hidden}")
        if frame.time >= self._next:
            self._next = frame.time + 1.0
            poses = "  ".join(_pose(state) for state in states) or "no block is followed yet"
            _say(frame.time, poses)


def _say(time: float, *words: str) -> None:
    """Print what happened; a marker's name may hold what a terminal obeys."""
    print(printable("  ".join([f"{time:9.2f} s", *words])), flush=True)


def _classes(observed: AssemblySeen) -> str:
    if observed.outcome:
        return observed.outcome
    names = sorted(observed.possible)
    if not names:
        return f"unknown: {len(observed.hidden)} blocks are hidden, any class is possible"
    if len(names) == 1:
        return names[0]
    more = f" and {len(names) - _MOST_CLASSES} more" if len(names) > _MOST_CLASSES else ""
    return "one of " + ", ".join(names[:_MOST_CLASSES]) + more


def _pose(state: TrackState) -> str:
    mark = "?" if state.measured is None else ("!" if state.ambiguous > 0 else "")
    return f"{state.id}{mark} ({100 * state.x:.2f}, {100 * state.y:.2f}) cm {state.theta:+.2f} rad"
