"""`driftwalk markers`: what the markers look like."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from driftwalk.cli.options.flatten_options import with_options
from driftwalk.cli.options.shared_types import Replace, option
from driftwalk.cli.options.tracking import TrackingOptions
from driftwalk.cli.terminal.help import HelpCommand, HelpGroup
from driftwalk.cli.terminal.output import print_next, print_note, print_table
from driftwalk.core.errors import DriftwalkError, InputError

_REMEDY = (
    "take a video in brighter, even light, with stronger colours on the discs, or a part of it in "
    "which several blocks are seen whole"
)
markers_app = typer.Typer(add_completion=False, cls=HelpGroup)


@markers_app.command(cls=HelpCommand)
@with_options(TrackingOptions, "source", "camera", "tank", "scale", "fps", "side")
def teach(
    options: TrackingOptions,
    out: Annotated[Path, option("--out -o FILE.toml", "File to write.")],
    overwrite: Replace = False,
) -> None:
    """Propose the two colours and the size of the markers from a few frames.

    A picture with the same name and the suffix .png shows the detections: look at it.
    """
    from driftwalk.cli.recordings.tracking_parts import find_camera
    from driftwalk.core.files.atomic import require_free, require_target
    from driftwalk.track import propose_markers, sample_images, save_markers, save_picture

    existing = "replace" if overwrite else "error"
    require_target(out, existing=existing, endings=(".toml",))
    picture = out.with_suffix(".png")
    require_free(picture, existing=existing)
    images = sample_images(options.source, 9, rate=options.fps)
    found = find_camera(options, images)
    try:
        proposal = propose_markers(images, found, block_side=options.side)
    except InputError as error:
        raise InputError(f"{options.source}: {error}; {_REMEDY}") from None
    save_markers(out, proposal.marker)
    try:
        save_picture(picture, proposal.picture)
    except DriftwalkError:
        if not overwrite:  # it would stand in the way of the next try
            out.unlink(missing_ok=True)
        raise
    marker = proposal.marker
    rows: list[list[Any]] = [
        ["distance of the discs (mm)", 1e3 * marker.spacing_m],
        ["diameter of a disc (mm)", 1e3 * marker.size_m],
        ["pairs measured", proposal.pairs],
        *[["colour seen", str(seen)] for seen in proposal.colours],
    ]
    print_table(rows)
    print_note(f"wrote {out} and {picture}")
    reach, side = marker.spacing_m + marker.size_m, options.side
    if side is not None and reach > side:
        print_note(
            f"warning: the two discs reach over {1e3 * reach:.3g} mm, and the block's side is "
            f"{1e3 * side:.3g} mm: unless they lie along its diagonal the scale is wrong; check "
            "--tank, --scale or --camera"
        )
    stated = {"camera": options.camera, "tank": options.tank, "scale": options.scale}
    scale = [f"--{name}={value}" for name, value in stated.items() if value is not None]
    recording = out.with_suffix(".nc")
    print_next("track", Path(options.source), "--markers", out, *scale, "-o", recording)


@markers_app.callback()
def _markers() -> None:
    """Describe the markers on the blocks."""
