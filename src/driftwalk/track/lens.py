"""Calibration of a camera from images of a board: the lens, and the plane of the water."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.core.extras import require_opencv
from driftwalk.track.camera import Camera, Lens
from driftwalk.track.detect.tags import dictionary_of
from driftwalk.track.types import Image


class CornerPolicy(NamedTuple):
    """How far around a corner its exact place is searched for."""

    share_of_square: float = 0.3
    """Half the side of the window, in squares: no other corner is in it; chosen by hand."""
    share_of_gap: float = 0.8
    """Half the side of the window, in gaps between a marker and the edge of its square; chosen
    by hand."""


_CORNERS: Final = CornerPolicy()


@dataclass(frozen=True)
class Board:
    """A flat board with corners at known places.

    Parameters
    ----------
    columns, rows : int
        Number of squares along each side (a chessboard has one corner less than squares).
    square_m : float
        Side of a square [m].
    kind : {"chessboard", "charuco"}
        A chessboard must be seen whole; of a ChArUco board, a part is enough.
    marker_m : float, optional
        Side of a ChArUco board's tags [m].
    dictionary : str
        Dictionary of a ChArUco board's tags, as OpenCV names it.

    Raises
    ------
    InputError
        When a size is out of range.

    Examples
    --------
    >>> Board(columns=9, rows=7, square_m=0.02).corners()[:2].tolist()
    [[0.02, 0.02], [0.04, 0.02]]
    """

    columns: int
    rows: int
    square_m: float
    kind: Literal["chessboard", "charuco"] = "chessboard"
    marker_m: float | None = None
    dictionary: str = "DICT_4X4_50"

    def __post_init__(self) -> None:
        """Check the sizes."""
        if self.kind not in ("chessboard", "charuco"):
            raise InputError(f"a board is a chessboard or charuco, not '{self.kind}'")
        if min(self.columns, self.rows) < 4:
            raise InputError(f"a board has 4 x 4 squares or more, got {self.columns} x {self.rows}")
        if not self.square_m > 0.0:
            raise InputError(f"a board's squares must be above zero metres, got {self.square_m}")
        if self.kind == "charuco" and not 0.0 < (self.marker_m or 0.0) < self.square_m:
            raise InputError(
                f"the tags of a charuco board are smaller than its squares of {self.square_m:g} m: "
                f"state their side; got {self.marker_m}"
            )

    def corners(self) -> Floats:
        """Return the places of all inner corners on the board [m], shape (n, 2), row by row."""
        column, row = np.meshgrid(np.arange(1, self.columns), np.arange(1, self.rows))
        places = np.stack([column.ravel(), row.ravel()], axis=-1).astype(np.float64)
        return np.asarray(places * self.square_m, dtype=np.float64)

    def find(self, image: Image) -> tuple[Floats, Floats] | None:
        """Return places on the board [m] and in the image [px] of the corners seen, or None."""
        cv2 = require_opencv("calibration of a camera")
        grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
        find = self._chessboard if self.kind == "chessboard" else self._charuco
        return find(cv2, grey)

    def charuco_board(self, cv2: Any) -> Any:
        """Return OpenCV's object for a ChArUco board."""
        return cv2.aruco.CharucoBoard(
            (self.columns, self.rows),
            self.square_m,
            self.marker_m,
            dictionary_of(cv2, self.dictionary),
        )

    def _chessboard(self, cv2: Any, grey: Any) -> tuple[Floats, Floats] | None:
        size = (self.columns - 1, self.rows - 1)
        flags = cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY
        found, corners = cv2.findChessboardCornersSB(grey, size, flags=flags)
        if not found:
            return None
        pixels = _refined(cv2, grey, corners, _CORNERS.share_of_square)
        # Turned by half a turn the grid is the same: the board's x axis points to the right.
        to_the_right = pixels[size[0] - 1 :: size[0]] - pixels[:: size[0]]
        return self.corners(), pixels if to_the_right[:, 0].sum() >= 0 else pixels[::-1].copy()

    def _charuco(self, cv2: Any, grey: Any) -> tuple[Floats, Floats] | None:
        detector = cv2.aruco.CharucoDetector(self.charuco_board(cv2))
        corners, numbers, _, _ = detector.detectBoard(grey)
        # Four corners determine the plane; twice as many show a wrong one.
        if numbers is None or len(numbers) < 8:
            return None
        which = np.asarray(numbers).ravel()
        # A window that reaches a tag would find the tag's corner.
        free = _CORNERS.share_of_gap * (1.0 - (self.marker_m or 0.0) / self.square_m) / 2.0
        share = min(free, _CORNERS.share_of_square)
        return self.corners()[which], _refined(cv2, grey, corners, share)


def _refined(cv2: Any, grey: Any, corners: Any, share: float) -> Floats:
    """Return corners [px] once more, each from a window of a share of a square to each side."""
    pixels = np.asarray(corners, dtype=np.float32).reshape(-1, 2)
    apart = np.hypot(*(pixels[:, None] - pixels).transpose(2, 0, 1))
    half = int(np.clip(share * apart[apart > 0].min(), 2, 15))
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 50, 1e-3)
    # It works in place.
    found = cv2.cornerSubPix(grey, pixels[:, None].copy(), (half, half), (-1, -1), stop)
    return np.asarray(found, dtype=np.float64).reshape(-1, 2)


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
    found = {index: board.find(image) for index, image in enumerate(images)}
    seen = {index: corners for index, corners in found.items() if corners is not None}
    if len(seen) < 3:
        raise InputError(
            f"the {board.kind} of {board.columns} x {board.rows} squares was found in {len(seen)} "
            f"of {len(images)} images, 3 are needed: {_advice(board)}"
        )
    flat = [np.column_stack([places, np.zeros(len(places))]) for places, _ in seen.values()]
    ((rows, columns),) = sizes
    rms, matrix, distortion, *_ = cv2.calibrateCamera(
        [places.astype(np.float32) for places in flat],
        [pixels.astype(np.float32) for _, pixels in seen.values()],
        (columns, rows),
        None,
        None,
        flags=cv2.CALIB_FIX_K3,
    )
    bent = dict(zip(("k1", "k2", "p1", "p2"), np.ravel(distortion).tolist(), strict=False))
    lens = Lens(
        focal_x_px=float(matrix[0, 0]),
        focal_y_px=float(matrix[1, 1]),
        centre_column_px=float(matrix[0, 2]),
        centre_row_px=float(matrix[1, 2]),
        **bent,
    )
    return LensCalibration(lens, float(rms), list(seen), sorted(found.keys() - seen.keys()))


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


def _is_right_handed(world: Floats, pixels: Floats) -> bool:
    """Return whether places and pixels turn the same way round."""
    affine = np.linalg.lstsq(np.column_stack([world, np.ones(len(world))]), pixels, rcond=None)[0]
    return bool(np.linalg.det(affine[:2]) > 0.0)
