"""`driftwalk camera`: what the camera does to the world."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

import typer

from driftwalk.cli.options.shared_types import (
    PANEL,
    Json,
    Replace,
    argument,
    flag,
    option,
    optional,
)
from driftwalk.cli.terminal.help import HelpCommand, HelpGroup
from driftwalk.cli.terminal.output import print_json, print_next, print_note, print_table
from driftwalk.core.errors import FormatError, InputError

if TYPE_CHECKING:
    from driftwalk.track import Board, Camera

# Corners are found to a tenth of a pixel; farther off, the board or the lens is another one; chosen
# by hand.
_POOR_PX: Final = 1.0
camera_app = typer.Typer(add_completion=False, cls=HelpGroup)


@camera_app.command(cls=HelpCommand)
def calibrate(
    images: Annotated[
        list[Path],
        argument(
            "BOARD_IMAGES...",
            "Images of the board; in the first, the board lies at the height of the markers.",
        ),
    ],
    out: Annotated[Path, option("--out -o FILE.toml", "File to write.")],
    squares: Annotated[str, option("--squares COLUMNSxROWS", "Squares of the board, such as 9x7.")],
    square: Annotated[float, option("--square", "Side of a square.", unit="m", panel=PANEL)],
    board: Literal["chessboard", "charuco"] = optional(
        "--board", "Kind of the board.", default="chessboard"
    ),
    tag: float | None = optional("--tag", "Side of a ChArUco board's tags.", unit="m", panel=PANEL),
    dictionary: str = optional(
        "--dictionary DICT", "Dictionary of these tags.", default="DICT_4X4_50"
    ),
    no_lens: bool = flag(
        "--no-lens", "Find only the plane; one image is enough, and lines stay straight."
    ),
    overwrite: Replace = False,
    json: Json = False,
) -> None:
    """Find the lens and the plane of the water from images of a board.

    The first image defines the plane: in it, the board must lie at the height of the markers. For
    the lens, give three images or more, with the board tilted and in different parts of the
    picture.
    """
    from driftwalk.core.files.atomic import require_target
    from driftwalk.track import Board, save_camera

    require_target(out, existing="replace" if overwrite else "error", endings=(".toml",))
    columns, rows = _squares(squares)
    of = Board(columns, rows, square, kind=board, marker_m=tag, dictionary=dictionary)
    camera, found = _calibrated([_read(path) for path in images], images, of, lens=not no_lens)
    save_camera(out, camera)
    if json:
        print_json({"out": out, **found})
        return
    print_table([[key.replace("_", " "), value] for key, value in found.items()])
    print_note(f"wrote {out}")
    print_next("markers teach", "VIDEO", "--camera", out, "-o", "markers.toml")


def _calibrated(
    pictures: Sequence[Any], paths: Sequence[Path], board: Board, *, lens: bool
) -> tuple[Camera, dict[str, Any]]:
    """Return the camera, and what to say about it."""
    from driftwalk.track import calibrate_lens, camera_from_board

    facts: dict[str, Any] = {"images": len(pictures)}
    known = None
    if lens:
        found = calibrate_lens(pictures, board)
        known = found.lens
        facts |= {"images_used": len(found.used), "lens_rms_px": found.rms_px}
        for index in found.not_found:
            print_note(f"warning: {paths[index]}: the board is not found in this image")
    camera = camera_from_board(pictures[0], board, known)
    if (camera.reprojection_rms_px or 0.0) > _POOR_PX:
        print_note(
            f"warning: the corners lie {camera.reprojection_rms_px:.2g} px off a plane: check "
            "--squares" + ("" if lens else ", and that lines are straight without --no-lens")
        )
    return camera, facts | {"plane_rms_px": camera.reprojection_rms_px}


def _squares(text: str) -> tuple[int, int]:
    columns, _, rows = text.lower().partition("x")
    if not (columns.isdigit() and rows.isdigit()):
        raise InputError(f"--squares is columns x rows, such as 9x7, got '{text}'")
    return int(columns), int(rows)


def _read(path: Path) -> Any:
    from driftwalk.core.extras import read_image

    if not path.is_file():
        raise FormatError("no such image", path=path)
    return read_image(path)


@camera_app.callback()
def _camera() -> None:
    """Calibrate the camera."""
