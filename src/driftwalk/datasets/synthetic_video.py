"""Synthetic videos of floating blocks, with exact poses: for tests, and to try settings on.

Everything here is drawn: nothing was filmed. A frame is put together from how much of each pixel
the block and its two discs cover, so an edge lies where it should to a small part of a pixel.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Floats, Singles
from driftwalk.core.errors import InputError
from driftwalk.core.extras import require_opencv
from driftwalk.core.random_streams import VideoStream
from driftwalk.datasets.synthetic_video_settings import (
    Colour,
    Glare,
    VideoSettings,
    image_to_world,
    local_scale,
    marker_points,
    place_bars,
    ripples,
    shading,
    world_to_image,
)

if TYPE_CHECKING:
    import xarray as xr

Image = npt.NDArray[np.uint8]

_FINE: Final = 3
"""Points along each side of a pixel at which coverage is found; chosen by hand."""
_STEP_PX: Final = 0.4
"""Way of a block between two exposures of a frame [px]: below the blur of an edge; chosen by
hand."""
_MOST_EXPOSURES: Final = 16
"""Exposures of a frame at most, a bound on the time; chosen by hand."""
_NOISE_FRAMES: Final = 4
"""Frames of noise that are drawn; each frame begins at another place of it. Chosen by hand."""
_BAR: Final[Colour] = (44, 40, 40)
"""Colour of a bar that hides blocks, a dark grey (blue, green, red)."""


def render_video(
    trajectory: xr.Dataset, settings: VideoSettings | None = None
) -> Iterator[tuple[float, Image]]:
    """Draw the frames of a synthetic video, one for each sample of a trajectory.

    Parameters
    ----------
    trajectory : xarray.Dataset
        A `trajectory` with orientations, of any number of blocks; a block is not drawn where its
        position is NaN.
    settings : VideoSettings, optional
        Camera, blocks and disturbances; without noise when left out.

    Yields
    ------
    time : float
        Time stamp of the frame [s].
    image : array, shape (rows, columns, 3)
        Blue, green, red, uint8.

    Returns
    -------
    iterator
        Of (time, image).

    Raises
    ------
    InputError
        When a block has a position but no orientation, or OpenCV is not installed.

    Examples
    --------
    >>> import driftwalk as dw
    >>> track = dw.tank30_recording("without_noise").isel(time=slice(0, 2))
    >>> small = dw.video_settings(width_px=160, height_px=120, px_per_m=375.0)
    >>> [(time, image.shape) for time, image in dw.render_video(track, small)]
    [(0.0, (120, 160, 3)), (0.1, (120, 160, 3))]
    """
    painter = _Painter(trajectory, settings if settings is not None else VideoSettings())
    return (
        (float(time), painter.frame(index, float(time))) for index, time in enumerate(painter.time)
    )


def video_truth(trajectory: xr.Dataset, settings: VideoSettings | None = None) -> xr.Dataset:
    """Return the exact poses in a synthetic video, and the visible share of each marker.

    Parameters
    ----------
    trajectory : xarray.Dataset
        A `trajectory`, as given to `render_video`.
    settings : VideoSettings, optional
        As given to `render_video`.

    Returns
    -------
    xarray.Dataset
        The `trajectory` with, on (time, body), ``column``, ``row`` [px] of the marker's centre and
        ``visible``, the share of the marker that lies in the image and under no bar or glare.

    Examples
    --------
    >>> import driftwalk as dw
    >>> track = dw.tank30_recording("without_noise").isel(time=slice(0, 2))
    >>> dw.video_truth(track, dw.video_settings("clean"))["visible"].values.ravel().tolist()
    [1.0, 1.0]
    """
    painter = _Painter(trajectory, settings if settings is not None else VideoSettings())
    pixels = world_to_image(painter.settings, painter.poses[..., :2])
    visible = np.stack([painter.visible(index) for index in range(painter.time.size)])
    where = ("time", "body")
    return trajectory.assign(
        column=(where, pixels[..., 0], {"units": "px"}),
        row=(where, pixels[..., 1], {"units": "px"}),
        visible=(where, visible, {"units": "1"}),
    ).assign_attrs(
        simulated="yes",
        arena=json.dumps({"shape": "circle", "diameter_m": painter.settings.tank_diameter_m}),
    )


def write_video(
    path: str | Path, trajectory: xr.Dataset, settings: VideoSettings | None = None
) -> Path:
    """Write a synthetic video to a file.

    Parameters
    ----------
    path : path-like
        ``.mkv`` or ``.avi`` keep every pixel as drawn (FFV1); ``.mp4`` (MPEG-4) loses some, as a
        camera's file does.
    trajectory : xarray.Dataset
        A `trajectory` with a constant rate.
    settings : VideoSettings, optional
        Camera, blocks and disturbances; without noise when left out.

    Returns
    -------
    pathlib.Path
        The file.

    Raises
    ------
    InputError
        When the rate is not constant, the suffix is another, or the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> import driftwalk as dw
    >>> track = dw.tank30_recording("without_noise").isel(time=slice(0, 3))
    >>> small = dw.video_settings(width_px=160, height_px=120, px_per_m=375.0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     dw.write_video(f"{folder}/synthetic.mkv", track, small).name
    'synthetic.mkv'
    """
    cv2 = require_opencv("writing a video")
    file = Path(path)
    codecs = {".mkv": "FFV1", ".avi": "FFV1", ".mp4": "mp4v"}
    if file.suffix.lower() not in codecs:
        raise InputError(f"{file}: a synthetic video is written as {', '.join(codecs)}")
    steps = np.diff(trajectory["time"].values)
    if steps.size == 0 or steps.max() - steps.min() > 1e-3 * steps.min():
        raise InputError(
            "a video file has one rate: the trajectory needs two samples or more, equally spaced"
        )
    chosen = settings if settings is not None else VideoSettings()
    writer = cv2.VideoWriter(
        str(file),
        cv2.VideoWriter_fourcc(*codecs[file.suffix.lower()]),
        float(1.0 / steps.mean()),
        (chosen.width_px, chosen.height_px),
    )
    if not writer.isOpened():
        raise InputError(f"{file}: cannot be written as a video; is the folder there?")
    for _, image in render_video(trajectory, chosen):
        writer.write(image)
    writer.release()
    return file


class _Painter:
    """Parts that are the same in all frames: the empty tank, the light, the poses and rates."""

    def __init__(self, trajectory: xr.Dataset, settings: VideoSettings) -> None:
        self.cv2: Any = require_opencv("drawing a synthetic video")
        self.settings = settings
        self.time: Floats = np.asarray(trajectory["time"].values, dtype=np.float64)
        columns = [trajectory[name].transpose("time", "body").values for name in ("x", "y")]
        theta = trajectory["theta"].transpose("time", "body").values
        if (np.isfinite(columns[0]) & ~np.isfinite(theta)).any():
            raise InputError("a block is drawn with its orientation, and the trajectory lacks some")
        self.poses: Floats = np.stack([*columns, theta], axis=-1).astype(np.float64)
        self.rates = _rates(self.time, self.poses)
        self.bars = place_bars(settings, self.time, self.poses.shape[1])
        self.glare = Glare(settings)
        self.points = marker_points(settings)
        self.world = self._world_map(_FINE)
        self.pixel_world = self._world_map(1)
        self.tank = self._empty_tank()
        self.light = np.repeat(shading(settings)[..., None], 3, axis=2)
        # Drawing new noise for each frame would take longer than all the rest.
        generator = np.random.default_rng([settings.seed, VideoStream.IMAGE])
        count = _NOISE_FRAMES * self.tank.size if settings.noise_std > 0.0 else 0
        self.noise: Singles = generator.standard_normal(count, dtype=np.float32)
        self.noise *= np.float32(settings.noise_std)

    def frame(self, index: int, time: float) -> Image:
        """Return one frame."""
        settings = self.settings
        image = self.tank
        if settings.ripple > 0.0:
            image = image * ripples(settings, self.pixel_world, time)[..., None]
        image = image.copy()
        for body in range(self.poses.shape[1]):
            if np.isfinite(self.poses[index, body]).all():
                self._paint_block(image, index, body)
        if settings.glare_share > 0.0:
            opacity = self.glare.opacity(time)[..., None]
            image = image * (1.0 - opacity) + 255.0 * opacity
        image = image * self.light
        if settings.blur_px > 0.0:
            image = self.cv2.GaussianBlur(image, (0, 0), settings.blur_px)
        if settings.noise_std > 0.0:
            # A stretch of the drawn noise, from a place of the frame's own.
            generator = np.random.default_rng([settings.seed, VideoStream.IMAGE, index])
            start = int(generator.integers(self.noise.size - image.size))
            image = image + self.noise[start : start + image.size].reshape(image.shape)
        # Rounds, and stops at 255; what is below zero is stopped before.
        return np.asarray(self.cv2.convertScaleAbs(self.cv2.max(image, 0.0)), dtype=np.uint8)

    def visible(self, index: int) -> Floats:
        """Return the share of each marker that can be seen in a frame, shape (bodies,)."""
        shares = np.full(self.poses.shape[1], np.nan)
        for body in np.flatnonzero(np.isfinite(self.poses[index, :, 0])):
            world = self._from_marker(self.poses[index, body], self.points)
            seen = np.ones(len(self.points), dtype=bool)
            for other in np.flatnonzero(np.isfinite(self.bars.offset[index])):
                own = self._to_marker(self.poses[index, other], world)
                # NaN where that body has a gap: it hides nothing.
                seen &= ~(self.bars.depth(index, int(other), own) > 0.0)
            pixels = world_to_image(self.settings, world)
            limit = np.array([self.settings.width_px, self.settings.height_px]) - 0.5
            seen &= ((pixels > -0.5) & (pixels < limit)).all(axis=-1)
            if self.settings.glare_share > 0.0:
                seen &= self.glare.height(pixels, float(self.time[index])) < 0.0
            shares[body] = seen.mean()
        return shares

    def _paint_block(self, image: Singles, index: int, body: int) -> None:
        box = self._box(index, body)
        if box is None:
            return
        rows, columns = box
        part = image[rows, columns]
        block, first, second, bar = self._coverage(index, body, rows, columns)
        settings = self.settings
        part *= (1.0 - block)[..., None]
        for share, colour in (
            (block - first - second, settings.block),
            (first, settings.disc_1),
            (second, settings.disc_2),
        ):
            part += share[..., None] * _bgr(colour)
        part *= (1.0 - bar)[..., None]
        part += bar[..., None] * _bgr(_BAR)

    def _coverage(self, index: int, body: int, rows: slice, columns: slice) -> list[Singles]:
        """Return the shares of the pixels of a box that block, discs and bar cover."""
        fine = tuple(slice(s.start * _FINE, s.stop * _FINE) for s in (rows, columns))
        world = self.world[fine]
        pose, rate = self.poses[index, body], self.rates[index, body]
        scale = local_scale(self.settings, pose[:2]) * _FINE
        moments = self._moments(rate, rows)
        total = np.zeros((4, *world.shape[:2]), dtype=np.float32)
        for moment in moments:
            # Each row of fine points has its own moment under a rolling shutter.
            at = pose + rate * np.repeat(moment, _FINE)[:, None]
            total += self._shapes(index, body, world, at, scale)
        total /= len(moments)
        height, width = rows.stop - rows.start, columns.stop - columns.start
        return list(total.reshape(4, height, _FINE, width, _FINE).mean(axis=(2, 4)))

    def _shapes(self, index: int, body: int, world: Singles, pose: Floats, scale: float) -> Singles:
        settings = self.settings
        own = self._to_marker(pose[:, None, :].astype(np.float32), world)
        turn = settings.marker_angle_rad
        u = own[..., 0] * np.cos(turn) - own[..., 1] * np.sin(turn)
        v = own[..., 0] * np.sin(turn) + own[..., 1] * np.cos(turn)
        depth = settings.block_side_m / 2 - np.maximum(np.abs(u), np.abs(v))
        half, radius = settings.marker_spacing_m / 2, settings.marker_diameter_m / 2
        depths = [
            depth,
            radius - np.hypot(own[..., 0] + half, own[..., 1]),
            radius - np.hypot(own[..., 0] - half, own[..., 1]),
        ]
        with_bar = np.isfinite(self.bars.offset[index, body])
        depths.append(self.bars.depth(index, body, own) if with_bar else np.full_like(depth, -1.0))
        covered = np.clip(0.5 + np.stack(depths) * scale, 0.0, 1.0)
        covered[0] = np.maximum(covered[0], covered[1] + covered[2])
        return np.asarray(covered, dtype=np.float32)

    def _moments(self, rate: Floats, rows: slice) -> list[Floats]:
        """Return the moments at which a block is drawn, relative to its time stamp, by row [s]."""
        settings = self.settings
        row = np.arange(rows.start, rows.stop)
        rolling = settings.rolling_s * (row / max(settings.height_px - 1, 1) - 0.5)
        speed = np.hypot(rate[0], rate[1]) + abs(rate[2]) * settings.block_side_m
        way = speed * settings.exposure_s * settings.px_per_m
        count = int(np.clip(np.ceil(way / _STEP_PX), 1, _MOST_EXPOSURES))
        offsets = ((np.arange(count) + 0.5) / count - 0.5) * settings.exposure_s
        return [rolling + offset for offset in offsets]

    def _box(self, index: int, body: int) -> tuple[slice, slice] | None:
        """Return the rows and columns that a block and its bar can touch; None outside."""
        settings, rate = self.settings, self.rates[index, body]
        late = settings.exposure_s / 2 + settings.rolling_s / 2
        size = 1.1 if np.isfinite(self.bars.offset[index, body]) else 0.75
        reach = size * settings.block_side_m + np.hypot(rate[0], rate[1]) * late
        corners = np.array([[-1, -1], [-1, 1], [1, -1], [1, 1]]) * reach
        pixels = world_to_image(settings, self.poses[index, body, :2] + corners)
        low = np.floor(pixels.min(axis=0)).astype(int)
        high = np.ceil(pixels.max(axis=0)).astype(int) + 1
        columns = slice(max(int(low[0]), 0), min(int(high[0]), settings.width_px))
        rows = slice(max(int(low[1]), 0), min(int(high[1]), settings.height_px))
        inside = columns.start < columns.stop and rows.start < rows.stop
        return (rows, columns) if inside else None

    def _to_marker(self, pose: Floats, world: npt.NDArray[Any]) -> Floats:
        """Return world points in the frame of a marker: u from disc 1 to disc 2."""
        angle = pose[..., 2] + self.settings.marker_angle_rad
        x, y = world[..., 0] - pose[..., 0], world[..., 1] - pose[..., 1]
        cos, sin = np.cos(angle), np.sin(angle)
        return np.stack([cos * x + sin * y, cos * y - sin * x], axis=-1)

    def _from_marker(self, pose: Floats, own: Floats) -> Floats:
        angle = pose[2] + self.settings.marker_angle_rad
        cos, sin = np.cos(angle), np.sin(angle)
        x, y = own[..., 0], own[..., 1]
        return np.stack([pose[0] + cos * x - sin * y, pose[1] + sin * x + cos * y], axis=-1)

    def _world_map(self, fine: int) -> Singles:
        """Return the world point of every fine point of the image."""
        settings = self.settings
        column = (np.arange(settings.width_px * fine) + 0.5) / fine - 0.5
        row = (np.arange(settings.height_px * fine) + 0.5) / fine - 0.5
        pixels = np.stack(np.meshgrid(column, row), axis=-1)
        return image_to_world(settings, pixels).astype(np.float32)

    def _empty_tank(self) -> Singles:
        settings = self.settings
        image = np.empty((settings.height_px, settings.width_px, 3), dtype=np.float32)
        image[:] = _bgr(settings.water)
        if settings.rim_m > 0.0:
            radius = np.hypot(self.world[..., 0], self.world[..., 1])
            beyond = radius - settings.tank_diameter_m / 2
            scale = settings.px_per_m * _FINE
            depth = np.minimum(beyond, settings.rim_m - beyond)
            fine = np.clip(0.5 + depth * scale, 0.0, 1.0)
            share = fine.reshape(settings.height_px, _FINE, settings.width_px, _FINE)
            share = share.mean(axis=(1, 3))[..., None]
            image = image * (1.0 - share) + share * _bgr(settings.rim)
        return image


def _bgr(colour: Colour) -> Singles:
    return np.asarray(colour[::-1], dtype=np.float32)


def _rates(time: Floats, poses: Floats) -> Floats:
    """Return velocities and turning rates, zero where they are not known, shape of the poses."""
    rates = np.zeros_like(poses)
    if time.size > 1:
        steps = np.diff(poses, axis=0)
        steps[..., 2] = np.angle(np.exp(1j * steps[..., 2]))
        slopes = steps / np.diff(time)[:, None, None]
        none = np.full((1, *slopes.shape[1:]), np.nan)
        before, after = np.concatenate([none, slopes]), np.concatenate([slopes, none])
        both = np.where(np.isfinite(before), before, after)
        both = np.where(np.isfinite(after), (both + after) / 2, both)
        rates = np.where(np.isfinite(both), both, 0.0)
    return rates
