"""The camera: pixel to metre on the plane of the water, and back; the file `camera.toml`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import model_validator

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.model.section import Quantity, Section
from driftwalk.track.toml_file import load_sections, save_sections

_HEAD = """\
Camera of driftwalk: lens, and the plane of the water.
Pixels are (column, row), centres at whole numbers, rows downwards; metres have y up."""

Nine = tuple[float, float, float, float, float, float, float, float, float]


class Lens(Section):
    """The lens: the pinhole model with radial and tangential distortion.

    Examples
    --------
    >>> Lens(focal_x_px=700, focal_y_px=700, centre_column_px=319.5, centre_row_px=239.5).k1
    0.0
    """

    section_name: ClassVar[str] = "lens"

    focal_x_px: Annotated[float, Quantity("1", gt=0, le=1e6)]
    """Focal length along the columns, in pixels."""
    focal_y_px: Annotated[float, Quantity("1", gt=0, le=1e6)]
    """Focal length along the rows, in pixels."""
    centre_column_px: Annotated[float, Quantity("1", ge=-1e5, le=1e5)]
    """Column of the optical axis."""
    centre_row_px: Annotated[float, Quantity("1", ge=-1e5, le=1e5)]
    """Row of the optical axis."""
    k1: float = 0.0
    """Radial distortion, second order."""
    k2: float = 0.0
    """Radial distortion, fourth order."""
    k3: float = 0.0
    """Radial distortion, sixth order."""
    p1: float = 0.0
    """Tangential distortion, first."""
    p2: float = 0.0
    """Tangential distortion, second."""

    def straighten(self, points: Floats) -> Floats:
        """Return where pixels, shape (n, 2), would lie without distortion."""
        bent = self._normalised(points)
        straight = bent.copy()
        for _ in range(20):
            radial, shift = self._factors(straight)
            update = (bent - shift) / radial[:, None]
            if np.abs(update - straight).max(initial=0.0) < 1e-12:
                break
            straight = update
        return self._to_pixels(straight)

    def bend(self, points: Floats) -> Floats:
        """Return where pixels without distortion, shape (n, 2), lie in the image."""
        straight = self._normalised(points)
        radial, shift = self._factors(straight)
        return self._to_pixels(straight * radial[:, None] + shift)

    def _factors(self, points: Floats) -> tuple[Floats, Floats]:
        """Return radial factor and tangential shift at normalised points."""
        u, v = points[:, 0], points[:, 1]
        square = u * u + v * v
        radial = 1.0 + square * (self.k1 + square * (self.k2 + square * self.k3))
        return radial, np.stack(
            [
                2.0 * self.p1 * u * v + self.p2 * (square + 2.0 * u * u),
                self.p1 * (square + 2.0 * v * v) + 2.0 * self.p2 * u * v,
            ],
            axis=-1,
        )

    def _normalised(self, points: Floats) -> Floats:
        return (points - self._centre()) / self._focal()

    def _to_pixels(self, points: Floats) -> Floats:
        return points * self._focal() + self._centre()

    def _centre(self) -> Floats:
        return np.array([self.centre_column_px, self.centre_row_px])

    def _focal(self) -> Floats:
        return np.array([self.focal_x_px, self.focal_y_px])


class Camera(Section):
    """A camera: size of its images, lens, and the plane of the water.

    Without a plane it knows no metres: there is no default scale.

    Examples
    --------
    >>> import numpy as np
    >>> camera = Camera.from_scale(640, 480, px_per_m=1500.0)
    >>> camera.to_world(np.array([[319.5 + 150.0, 239.5]])).tolist()
    [[0.1, 0.0]]
    """

    width_px: Annotated[int, Quantity("1", whole=True, ge=1)]
    """Width of the images."""
    height_px: Annotated[int, Quantity("1", whole=True, ge=1)]
    """Height of the images."""
    plane_found_by: str | None = None
    """Source of the plane of the water: board, rim or scale."""
    homography_px_to_m: Nine | None = None
    """Straightened pixel (column, row, 1) to (x, y, 1) in m: 3 x 3, row by row."""
    tank_diameter_m: Annotated[float | None, Quantity("m", gt=0, le=1e3)] = None
    """Diameter of the tank whose rim was found."""
    reprojection_rms_px: Annotated[float | None, Quantity("1", ge=0)] = None
    """How well the calibration fits its boards."""
    lens: Lens | None = None
    """Lens; none is a lens without distortion."""

    @model_validator(mode="after")
    def _invertible(self) -> Self:
        if self.homography_px_to_m is not None:
            matrix = np.array(self.homography_px_to_m).reshape(3, 3)
            if not np.isfinite(matrix).all() or abs(np.linalg.det(matrix)) < 1e-300:
                raise ConfigurationError("homography_px_to_m has no inverse")
        return self

    @classmethod
    def from_scale(
        cls,
        width_px: int,
        height_px: int,
        *,
        px_per_m: float,
        centre_px: tuple[float, float] | None = None,
        lens: Lens | None = None,
    ) -> Camera:
        """Return a camera that looks straight down, with a stated scale.

        Parameters
        ----------
        width_px, height_px : int
            Size of the images.
        px_per_m : float
            Scale [px/m].
        centre_px : tuple of float, optional
            Straightened pixel of the origin; the image's middle when left out.
        lens : Lens, optional
            The lens.
        """
        if not (math.isfinite(px_per_m) and px_per_m > 0):
            raise InputError(f"a scale must be above zero pixels per metre, got {px_per_m}")
        column, row = centre_px or ((width_px - 1) / 2, (height_px - 1) / 2)
        s = 1.0 / px_per_m
        return cls(
            width_px=width_px,
            height_px=height_px,
            plane_found_by="scale",
            homography_px_to_m=(s, 0.0, -column * s, 0.0, -s, row * s, 0.0, 0.0, 1.0),
            lens=lens,
        )

    def to_world(self, points: Floats) -> Floats:
        """Return pixels, shape (n, 2), as metres, shape (n, 2)."""
        straight = points if self.lens is None else self.lens.straighten(points)
        return project(self._plane(), straight)

    def to_pixel(self, points: Floats) -> Floats:
        """Return metres, shape (n, 2), as pixels, shape (n, 2)."""
        straight = project(np.asarray(np.linalg.inv(self._plane()), dtype=np.float64), points)
        return straight if self.lens is None else self.lens.bend(straight)

    def jacobian(self, points: Floats) -> Floats:
        """Return d(x, y)/d(column, row) [m/px] at pixels, shape (n, 2, 2)."""
        columns = []
        for step in (np.array([0.5, 0.0]), np.array([0.0, 0.5])):
            ahead, behind = self.to_world(points + step), self.to_world(points - step)
            columns.append((ahead - behind) / (2.0 * 0.5))
        return np.stack(columns, axis=-1)

    def check_size(self, width: int, height: int) -> None:
        """Check that images are of the size that was calibrated.

        Raises
        ------
        InputError
            When they are not.
        """
        if (width, height) != (self.width_px, self.height_px):
            raise InputError(
                f"the camera was calibrated at {self.width_px} x {self.height_px} pixels, but the "
                f"images are {width} x {height}: calibrate at this size"
            )

    def _plane(self) -> Floats:
        if self.homography_px_to_m is None:
            raise InputError(
                "the camera has no scale: give the tank's diameter with `diameter` of "
                "`camera_from_rim`, or calibrate with a board that lies on the plane of the water"
            )
        return np.array(self.homography_px_to_m).reshape(3, 3)


def project(matrix: Floats, points: Floats) -> Floats:
    """Return points, shape (n, 2), after a 3 x 3 projective map."""
    mapped = np.column_stack([points, np.ones(len(points))]) @ matrix.T
    return np.asarray(mapped[:, :2] / mapped[:, 2:])


def load_camera(path: str | Path) -> Camera:
    """Read a `camera.toml`.

    Parameters
    ----------
    path : path-like
        The file.

    Returns
    -------
    Camera
        The camera.

    Raises
    ------
    FormatError
        When the file cannot be read, a key is unknown, or a value is out of range.

    Examples
    --------
    >>> load_camera("no/such/camera.toml")
    Traceback (most recent call last):
    driftwalk.core.errors.FormatError: no/such/camera.toml: no such camera file
    """
    return load_sections(path, Camera, what="camera")


def save_camera(path: str | Path, camera: Camera) -> Path:
    """Write a `camera.toml`, with the meaning of each key.

    Parameters
    ----------
    path : path-like
        The file.
    camera : Camera
        The object to write.

    Returns
    -------
    pathlib.Path
        The file.

    Examples
    --------
    >>> import tempfile
    >>> camera = Camera.from_scale(640, 480, px_per_m=1500.0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     load_camera(save_camera(f"{folder}/camera.toml", camera)) == camera
    True
    """
    return save_sections(path, camera, head=_HEAD)
