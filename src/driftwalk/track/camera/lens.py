"""Calibration of a camera from images of a board: the lens, and the plane of the water."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.core.extras import require_opencv
from driftwalk.track.camera.boards import Board
from driftwalk.track.camera.model import Camera, Lens
from driftwalk.track.types import Array, Image


@dataclass(frozen=True)
class LensCalibration:
    """A lens and its uncertainty.

    Parameters
    ----------
    lens : Lens
        The lens.
    rms_px : float
        Root mean square distance of the corners from where the lens puts them [px].
    used : list of int
        Images in which the board was found.
    not_found : list of int
        Images in which it was not.
    """

    lens: Lens
    rms_px: float
    used: list[int]
    not_found: list[int]


def calibrate_lens(images: Sequence[Image], board: Board) -> LensCalibration:
    """Calibrate the lens from images of a board in several positions.

    Parameters
    ----------
    images : sequence of array, shape (rows, columns, 3)
        Three or more, with the board tilted differently and in all parts of the image.
    board : Board
        The board.

    Returns
    -------
    LensCalibration
        The lens, and the images that were used.

    Raises
    ------
    InputError
        When the board is found in fewer than three images, or the images differ in size.

    Examples
    --------
    >>> import numpy as np
    >>> calibrate_lens([np.zeros((48, 64, 3), np.uint8)], Board(9, 7, 0.02))
    Traceback (most recent call last):
    driftwalk.core.errors.InputError: the chessboard of 9 x 7 squares was found in 0 of 1 images...
    """
    cv2 = require_opencv("calibration of a camera")
    sizes = {image.shape[:2] for image in images}
    if len(sizes) > 1:
        raise InputError("the images of the board differ in size: take all with the same camera")
    found = [board.find(image) for image in images]
    used = [index for index, seen in enumerate(found) if seen is not None]
    if len(used) < 3:
        raise InputError(
            f"the {board.kind} of {board.columns} x {board.rows} squares was found in {len(used)} "
            f"of {len(images)} images, 3 are needed: {_advice(board)}"
        )
    places, pixels = [], []
    for seen in found:
        if seen is not None:
            flat = np.column_stack([seen[0], np.zeros(len(seen[0]))])
            places.append(flat.astype(np.float32))
            pixels.append(seen[1].astype(np.float32))
    ((rows, columns),) = sizes
    rms, matrix, distortion, *_ = cv2.calibrateCamera(
        places, pixels, (columns, rows), None, None, flags=cv2.CALIB_FIX_K3
    )
    k1, k2, p1, p2 = (float(value) for value in np.asarray(distortion).ravel()[:4])
    lens = Lens(
        focal_x_px=float(matrix[0, 0]),
        focal_y_px=float(matrix[1, 1]),
        centre_column_px=float(matrix[0, 2]),
        centre_row_px=float(matrix[1, 2]),
        k1=k1,
        k2=k2,
        p1=p1,
        p2=p2,
    )
    not_found = [index for index in range(len(images)) if index not in used]
    return LensCalibration(lens, float(rms), used, not_found)


def camera_from_board(image: Image, board: Board, lens: Lens | None = None) -> Camera:
    """Return the camera whose plane is that of a board at the height of the water's surface.

    The origin is the board's middle, x along its rows of squares, y up. A chessboard looks the same
    after half a turn: its x points to the right of the image. That of a ChArUco board is its own.

    Parameters
    ----------
    image : array, shape (rows, columns, 3)
        With the board on the plane of the markers.
    board : Board
        The board.
    lens : Lens, optional
        The lens.

    Returns
    -------
    Camera
        With ``reprojection_rms_px``, how far the corners are from where the plane puts them.

    Raises
    ------
    InputError
        When the board is not found.

    Examples
    --------
    >>> import numpy as np
    >>> camera_from_board(np.zeros((48, 64, 3), np.uint8), Board(9, 7, 0.02))
    Traceback (most recent call last):
    driftwalk.core.errors.InputError: the chessboard of 9 x 7 squares was not found in the image ...
    """
    cv2 = require_opencv("calibration of a camera")
    seen = board.find(image)
    if seen is None:
        raise InputError(
            f"the {board.kind} of {board.columns} x {board.rows} squares was not found in the "
            f"image of the water's plane: {_advice(board)}"
        )
    places, pixels = seen
    middle = np.array([board.columns, board.rows]) * board.square_m / 2
    world = places - middle
    straight = pixels if lens is None else lens.straighten(pixels)
    if _is_right_handed(world, straight):
        # The board counts its rows downwards, as an image does; the world counts y upwards.
        world = world * np.array([1.0, -1.0])
    homography, _ = cv2.findHomography(straight, world, 0)
    if homography is None:
        raise InputError("the corners of the board lie on one line: take the image from above")
    nine: Any = tuple(float(value) for value in np.asarray(homography).ravel())
    camera = Camera(
        width_px=image.shape[1],
        height_px=image.shape[0],
        plane_found_by="board",
        homography_px_to_m=nine,
        lens=lens,
    )
    off = camera.to_pixel(world) - pixels
    rms = math.sqrt(float((off**2).sum(axis=1).mean()))
    return camera.model_copy(update={"reprojection_rms_px": rms})


def _advice(board: Board) -> str:
    """Return what to check when a board is not found."""
    what = "the number of squares (columns first)"
    if board.kind == "charuco":
        return f"check {what} and the tags' dictionary, and that the board is sharp and flat"
    return f"check {what}, and that the board is sharp, flat and seen whole"


def _is_right_handed(world: Array, pixels: Array) -> bool:
    """Return whether places and pixels turn the same way round."""
    with_one = np.column_stack([world, np.ones(len(world))])
    affine = np.linalg.lstsq(with_one, pixels, rcond=None)[0]
    return bool(np.linalg.det(affine[:2]) > 0.0)
