"""`driftwalk track`: a recording from a video or a camera, and the loop over its frames."""

from __future__ import annotations

import contextlib
import json
import signal
import time as clock
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any, Final

from driftwalk.cli.options.flatten_options import with_options
from driftwalk.cli.options.shared_types import Json, Replace, optional
from driftwalk.cli.options.tracking import TrackingOptions
from driftwalk.cli.recordings.live_output import LiveOutputs
from driftwalk.cli.terminal.output import (
    print_json,
    print_next,
    print_note,
    print_table,
    print_warnings,
    sibling,
)
from driftwalk.cli.terminal.progress import ProgressReporter
from driftwalk.core.errors import InputError
from driftwalk.core.text_files import parse_json, text_of_name

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.cli.recordings.tracking_parts import TrackingParts
    from driftwalk.track import AssemblySeen, Frame, FrameSource, OverlayWriter, TrackState


_SHOWN = {"duplicates": "doubled"}


@with_options(TrackingOptions)
def track(
    options: TrackingOptions,
    out: Path | None = optional(
        "--out -o FILE.nc", "Recording to write; needed without --explain."
    ),
    explain: int | None = optional(
        "--explain FRAME",
        "Write a PNG of this frame that shows each candidate and why it was rejected, then exit.",
        min=0,
    ),
    overwrite: Replace = False,
    json: Json = False,
) -> None:
    """Track blocks in a video or before a camera.

    The recording holds the measured poses, each with its covariance, and marks where identities
    could have been exchanged. Ctrl-C ends tracking and keeps everything tracked up to then.
    """
    from driftwalk.cli.recordings.tracking_parts import build_parts
    from driftwalk.core.files.atomic import require_free, require_target

    existing = "replace" if overwrite else "error"
    if explain is not None:
        _explain(options, explain, out, existing)
        return
    if out is None:
        raise InputError("name the recording to write: -o recording.nc")
    require_target(out, existing=existing, endings=(".nc",))
    if options.overlay is not None:
        require_free(options.overlay, existing=existing)
    run = TrackingRun(options, build_parts(options), out)
    run.run()
    found = summary(run)
    if json:
        print_json({"out": out, **found})
        return
    print_note(f"wrote {out}")
    _print(found)
    if options.bodies == 1:
        print_next("fit", out, "-o", sibling(out.with_suffix(""), "fit"))
    else:
        print_next("classify", out)


def _print(found: dict[str, Any]) -> None:
    rows = [
        [name, 100.0 * body["seen_share"], 100.0 * body["ambiguous_share"]]
        for name, body in found["bodies"].items()
    ]
    print_table(rows, columns=["body", "seen (%)", "ambiguous (%)"])
    print()
    counts = {**found["counts"], **found["counts"]["rejected"]}
    counts.pop("rejected")
    print_table([[_SHOWN.get(name, name.replace("_", " ")), n] for name, n in counts.items()])
    if found["frames_per_s"] is not None:
        print()
        print_table([["frames tracked per second", found["frames_per_s"]]])
    print_warnings([found["interrupted"]])


def _explain(options: TrackingOptions, number: int, out: Path | None, existing: str) -> None:
    """Draw one frame with everything that was found in it."""
    from driftwalk.cli.recordings.tracking_parts import build_parts
    from driftwalk.core.files.atomic import require_target
    from driftwalk.track import explain_frame, open_source, save_picture

    if out is not None and out.suffix == ".png":
        picture = out
    else:
        stem = Path(options.source.replace(":", "-")).stem if out is None else out.stem
        picture = (Path() if out is None else out.parent) / f"{stem}-frame-{number}.png"
    require_target(picture, existing=existing, endings=(".png",))
    parts = build_parts(options)
    opened = open_source(options.source, rate=options.fps, keep_stale=True)
    last = -1
    try:
        for frame in opened:
            last = frame.index
            if last >= number:
                break
    finally:
        opened.close()
    if last != number:
        raise InputError(f"{options.source}: there is no frame {number}; the last is {last}")
    found, rejected = parts.detector.detect(frame.image)
    save_picture(picture, explain_frame(frame.image, found, rejected, camera=parts.camera))
    rows = [[one.column, one.row, "found" + (f" {one.key}" if one.key else "")] for one in found]
    rows += [[one.column, one.row, one.reason] for one in rejected]
    print_table(rows, columns=["column (px)", "row (px)", "result"])
    print_note(f"wrote {picture}")


Pose = tuple[float, float, float]
Look = Callable[["Frame", "Sequence[TrackState]", "AssemblySeen | None", int], None]

_SAVE_EVERY_S: Final = 10.0
"""Least time between two saves [s]: a crash loses no more than this. Chosen by hand."""
# A save may take this share of the time, so that those of a long recording become rarer; chosen by
# hand.
_SAVING_SHARE: Final = 0.05
_MOST_KINDS: Final = 4
"""Kinds of rejected regions that the summary names, the most frequent ones; chosen by hand."""


class TrackingRun:
    """Tracks a source; what was tracked up to now can be saved at any time.

    Parameters
    ----------
    options : TrackingOptions
        The options as given.
    parts : TrackingParts
        See `build_parts`.
    out : Path or None
        The recording to write.
    look : callable, optional
        Is called with each frame, its states, what was observed, and how many frames were dropped
        up to now.
    """

    def __init__(
        self,
        options: TrackingOptions,
        parts: TrackingParts,
        out: Path | None,
        look: Look | None = None,
    ) -> None:
        self.options, self.parts, self.out, self._look = options, parts, out, look
        self.rejected: Counter[str] = Counter()
        self.interrupted: str | None = None
        self.frames = 0
        self.working_s = 0.0
        self.source_name = options.source
        self._names: set[str] = set()
        self._left_out: set[str] = set()
        self._source_counts: dict[str, int] = {}
        self._saved = clock.monotonic()
        self.saved = False
        self._pause = _SAVE_EVERY_S

    def run(self) -> None:
        """Track to the end of the source, to Ctrl-C, or to an error; all up to there is saved.

        Raises
        ------
        KeyboardInterrupt
            When a file was interrupted; a camera's recording ends that way.
        """
        from driftwalk.track import OverlayWriter, frame_count, open_source

        total = frame_count(self.options.source) or 0
        source = open_source(self.options.source, rate=self.options.fps)
        name = source.name if self.options.is_camera else Path(source.name).name
        self.source_name = text_of_name(name)
        with contextlib.ExitStack() as open_things:
            open_things.callback(source.close)
            open_things.enter_context(_termination_as_interrupt())
            live = LiveOutputs(self.options, self.parts, self.source_name, open_things)
            overlay = None
            if self.options.overlay is not None:
                overlay = OverlayWriter(self.options.overlay)
                open_things.callback(overlay.close)
            progress = open_things.enter_context(ProgressReporter("track"))
            try:
                for frame in source:
                    self._source_counts = source.counts.to_dict()
                    self._take(frame, source.waited_s, live, overlay)
                    dropped = self._source_counts["dropped"]
                    tell_progress(progress, frame.index + 1, total, dropped)
                    if clock.monotonic() - self._saved >= self._pause:
                        self._save(complete=False)
                self.interrupted = source.interrupted
            except KeyboardInterrupt:
                self.interrupted = f"interrupted after {self.frames} frames"
                if not self.options.is_camera:
                    self._keep_what_there_is(live, source)
                    raise
            except BaseException as error:
                self.interrupted = str(error)
                self._keep_what_there_is(live, source)
                raise
            live.end(self.interrupted)
            self._source_counts = source.counts.to_dict()
            self._save(complete=self.interrupted is None or self.options.is_camera)

    def _keep_what_there_is(self, live: LiveOutputs, source: FrameSource) -> None:
        """Save what was tracked before an unwanted end."""
        live.end(self.interrupted)
        self._source_counts = source.counts.to_dict()
        self._save(complete=False)
        if self.saved:
            print_note(f"wrote {self.out}: {self.frames} frames so far")

    def recording(self, *, complete: bool = True) -> xr.Dataset:
        """Return what was tracked up to now.

        Raises
        ------
        InputError
            When that is nothing; it says what was seen instead.
        """
        attrs: dict[str, Any] = {
            "source": self.source_name,
            # `source` is the recording's own name once it is read from a file.
            "tracked_from": self.source_name,
            "markers": text_of_name(Path(self.options.markers).name),
            "complete": "yes" if complete else "no",
        }
        if self.interrupted is not None:
            attrs["interrupted"] = self.interrupted
        diameter = self.parts.diameter
        if diameter is not None:
            arena = {"shape": "circle", "diameter_m": diameter, "center_m": [0.0, 0.0]}
            attrs["arena"] = json.dumps(arena)
        counts = {**self._source_counts, "rejected": dict(self.rejected)}
        try:
            return self.parts.tracker.finish(attrs=attrs, counts=counts)
        except InputError as error:
            raise InputError(f"{error}{self._what_was_there()}") from error

    def _what_was_there(self) -> str:
        """Return the rejected candidates, the most frequent first, and how to look at them."""
        kinds = [f"{kind} {number}" for kind, number in self.rejected.most_common(_MOST_KINDS)]
        turned_down = f"; rejected: {', '.join(kinds)}" if kinds else ""
        return f"{turned_down} (look at a frame with track ... --explain {self.frames // 2})"

    def _take(
        self, frame: Frame, waited_s: float, live: LiveOutputs, overlay: OverlayWriter | None
    ) -> None:
        from driftwalk.track import draw_states

        began = clock.perf_counter()
        found, rejected = self.parts.detector.detect(frame.image)
        self.rejected.update(one.kind for one in rejected)
        states = self.parts.tracker.step(frame.time, found)
        observed = self._observe(frame.time, states)
        self.working_s += clock.perf_counter() - began
        self.frames += 1
        dropped = self._source_counts.get("dropped", 0)
        live.publish(frame, states, observed, dropped=dropped, arrived=began - waited_s)
        if overlay is not None:
            overlay.write(draw_states(frame.image, states, self.parts.camera), frame.time)
        if self._look is not None:
            self._look(frame, states, observed, dropped)

    def _observe(self, time: float, states: Sequence[TrackState]) -> AssemblySeen | None:
        if self.parts.observer is None:
            return None
        seen = {
            state.id: (float(one.x), float(one.y), one.theta)
            for state in states
            if (one := state.measured) is not None and one.x is not None and one.y is not None
        }
        return self.parts.observer.step(time, self._watched(seen))

    def _watched(self, seen: dict[str, Pose]) -> dict[str, Pose]:
        """Leave out tags beyond the number of blocks: a misread one is not to end the run."""
        for name in seen:
            if name in self._names or name in self._left_out:
                continue
            if len(self._names) < (self.options.bodies or 0):
                self._names.add(name)
                continue
            self._left_out.add(name)
            print_note(f"warning: {name} is one more than --bodies; joins are reported without it")
        return {name: pose for name, pose in seen.items() if name in self._names}

    def _save(self, *, complete: bool) -> None:
        from driftwalk.record import save_trajectory

        began = clock.monotonic()
        if self.out is not None:
            # Nothing was tracked so far: there is nothing to lose.
            with contextlib.suppress(InputError):
                recording = self.recording(complete=complete)
                save_trajectory(recording, self.out, existing="replace")
                self.saved = True
        self._saved = clock.monotonic()
        self._pause = max(_SAVE_EVERY_S, (self._saved - began) / _SAVING_SHARE)


def tell_progress(progress: ProgressReporter, done: int, total: int, dropped: int) -> None:
    """Say how far it is and what was dropped; a file may hold more frames than it states."""
    remarks = [f"the source stated {total}, there are more"] if total < done else []
    if dropped:
        remarks.append(f"{dropped} frame{'' if dropped == 1 else 's'} dropped up to now")
    if total:
        progress(done, max(done, total), "; ".join(remarks))


@contextlib.contextmanager
def _termination_as_interrupt() -> Iterator[None]:
    """Let a request to end count as Ctrl-C, so that what was tracked is saved."""

    def stop(number: int, frame: FrameType | None) -> None:  # noqa: ARG001
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, stop)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def summary(run: TrackingRun) -> dict[str, Any]:
    """Return what a run found with units in the keys, ready for JSON."""
    import numpy as np

    recording = run.recording()
    seen = np.isfinite(recording["x"].values)
    ambiguous = recording["ambiguous"].values > 0
    names = [str(name) for name in recording["body"].values]
    return {
        "source": run.options.source,
        "frames": run.frames,
        "duration_s": float(np.ptp(recording["time"].values)),
        "bodies": {
            name: {
                "seen_share": float(seen[:, at].mean()),
                "ambiguous_share": float(ambiguous[:, at].mean()),
            }
            for at, name in enumerate(names)
        },
        "counts": parse_json(recording.attrs["counts"]),
        "frames_per_s": run.frames / run.working_s if run.working_s > 0 else None,
        "interrupted": run.interrupted,
    }
