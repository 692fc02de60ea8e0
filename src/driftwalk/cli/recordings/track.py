"""`driftwalk track`: a recording from a video or a camera."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from driftwalk.cli.options.flatten_options import with_options
from driftwalk.cli.options.shared import Json, Replace, option
from driftwalk.cli.options.tracking import TrackingOptions
from driftwalk.cli.terminal.output import (
    print_json,
    print_next,
    print_note,
    print_table,
    print_warnings,
    sibling,
)
from driftwalk.core.errors import InputError

_SHOWN = {"duplicates": "doubled"}


@with_options(TrackingOptions)
def track(
    options: TrackingOptions,
    out: Annotated[
        Path | None,
        option("--out", "-o FILE.nc", help="Recording to write; needed without --explain."),
    ] = None,
    explain: Annotated[
        int | None,
        option(
            "--explain FRAME",
            help="Write a PNG of this frame that shows each candidate and why it was "
            "rejected, then exit.",
            min=0,
        ),
    ] = None,
    overwrite: Replace = False,
    json: Json = False,
) -> None:
    """Track blocks in a video or before a camera.

    The recording holds the measured poses, each with its covariance, and marks where identities
    could have been exchanged. Ctrl-C ends tracking and keeps everything tracked up to then.
    """
    from driftwalk.cli.tracking.parts import build_parts
    from driftwalk.cli.tracking.run import TrackingRun, summary
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
    print_table(rows, columns=["body", "seen [%]", "ambiguous [%]"])
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
    from driftwalk.cli.tracking.parts import build_parts
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
    print_table(rows, columns=["column [px]", "row [px]", "result"])
    print_note(f"wrote {picture}")
