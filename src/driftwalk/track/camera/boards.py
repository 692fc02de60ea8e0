"""Calibration boards: chessboard and ChArUco, their corners in an image."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, Literal, NamedTuple

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.core.extras import require_opencv
from driftwalk.track.detect.tags import dictionary_of
from driftwalk.track.types import Array, Image


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

    def corners(self) -> Array:
        """Return the places of all inner corners on the board [m], shape (n, 2), row by row."""
        column, row = np.meshgrid(np.arange(1, self.columns), np.arange(1, self.rows))
        places = np.stack([column.ravel(), row.ravel()], axis=-1).astype(np.float64)
        return np.asarray(places * self.square_m, dtype=np.float64)

    def find(self, image: Image) -> tuple[Array, Array] | None:
        """Return places on the board [m] and in the image [px] of the corners seen, or None."""
        cv2 = require_opencv("calibration of a camera")
        grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
        return (
            self._chessboard(cv2, grey) if self.kind == "chessboard" else self._charuco(cv2, grey)
        )

    def charuco_board(self, cv2: Any) -> Any:
        """Return OpenCV's object for a ChArUco board."""
        return cv2.aruco.CharucoBoard(
            (self.columns, self.rows),
            self.square_m,
            self.marker_m,
            dictionary_of(cv2, self.dictionary),
        )

    def _chessboard(self, cv2: Any, grey: Any) -> tuple[Array, Array] | None:
        size = (self.columns - 1, self.rows - 1)
        flags = cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY
        found, corners = cv2.findChessboardCornersSB(grey, size, flags=flags)
        if not found:
            return None
        pixels = _refined(cv2, grey, corners, _CORNERS.share_of_square)
        # Turned by half a turn the grid is the same: the board's x axis points to the right.
        to_the_right = pixels[size[0] - 1 :: size[0]] - pixels[:: size[0]]
        return self.corners(), pixels if to_the_right[:, 0].sum() >= 0 else pixels[::-1].copy()

    def _charuco(self, cv2: Any, grey: Any) -> tuple[Array, Array] | None:
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


def _refined(cv2: Any, grey: Any, corners: Any, share: float) -> Array:
    """Return corners [px] once more, each from a window of a share of a square to each side."""
    pixels = np.asarray(corners, dtype=np.float32).reshape(-1, 2)
    apart = np.hypot(*(pixels[:, None] - pixels).transpose(2, 0, 1))
    spacing = apart[apart > 0].min()
    half = int(np.clip(share * spacing, 2, 15))
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 50, 1e-3)
    # It works in place.
    found = cv2.cornerSubPix(grey, pixels[:, None].copy(), (half, half), (-1, -1), stop)
    return np.asarray(found, dtype=np.float64).reshape(-1, 2)
