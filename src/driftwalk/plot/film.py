"""A film of what moves in the tank: blocks that assemble, or the bodies of a recording.

Frames become a GIF by Pillow, an MP4 by ffmpeg or by OpenCV.
"""

from __future__ import annotations

import contextlib
import itertools
import shutil
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Floats, Integers
from driftwalk.core.errors import InputError
from driftwalk.core.files.atomic import atomic_path, require_target
from driftwalk.plot.parts import style
from driftwalk.plot.parts.arena import CM_PER_M, arena_of, draw_arena, draw_scale_bar
from driftwalk.plot.parts.outcome_classes import empty_bars, poles_of, set_pole_bars
from driftwalk.plot.parts.style import PALETTE
from driftwalk.schema.check import require_kind

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Frame = npt.NDArray[np.uint8]
"""Red, green, blue: shape (rows, columns, 3)."""
FRAMES_PER_S: Final = {".gif": 12.5, ".mp4": 25.0}
"""A GIF counts in hundredths of a second: 12.5 frames per second are exact."""
CODECS: Final = ("vp09", "mp4v")
"""Encoders of OpenCV, best first: VP9, which browsers play, and MPEG-4."""
FILM_MM: Final = 101.6
"""Width and height of a film [mm]: an even number of dots, as encoders ask."""
DOTS_PER_INCH: Final = {".gif": 100, ".mp4": 200}
"""By ending: 400 dots a side for a GIF, whose size grows fast, and 800 for a film."""
TRAIL_S: Final = 5.0
"""How long the trail behind a body is, in seconds of the film."""
MOST_TRAILS: Final = 64
"""Bodies of a film up to which trails and pointers are drawn; chosen by eye."""
SHORTEST_S: Final = 0.2
"""Two frames of the slowest kind and more [s]; chosen by hand."""
MOST_FRAMES: Final = 15_000
"""Ten minutes of an MP4; a longer film is rather shown faster."""


@dataclass(frozen=True)
class _Scene:
    """The bodies of a film, in cm and s."""

    time: Floats
    place: Floats
    """x and y, (time, body, 2)."""
    theta: Floats
    color: Integers
    side: float | None
    slimness: float
    arena: dict[str, Any]
    pole: Any = None
    """Poles of the faces, (body, face); None: none are known."""


def write_animation(
    motion: xr.Dataset,
    file: str | Path,
    *,
    run: int = 0,
    seconds: float | None = None,
    speed: float | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Write a film of blocks that assemble, or of a recording, as GIF or as MP4.

    Blocks are coloured by assembly, the bodies of a recording each by its own colour. A line in a
    block points where its orientation does; a body without an orientation is a disc. Behind each
    lies its way of the last 5 s of the film. Faces that are magnets have a bar, red for N and white
    for S. The film has 12.5 frames per second as GIF and 25 as
    MP4; each shows the last sample up to its time, and a body that was not seen for three of its
    usual intervals is not shown. More than 64 bodies have no lines and no ways.

    Parameters
    ----------
    motion : xarray.Dataset
        An `assembly_path`, or a `trajectory`, whose attributes ``arena`` and ``block_side_m`` are
        used where they are there.
    file : path-like
        Where to write; the ending, ``.gif`` or ``.mp4``, says as what.
    run : int
        Which run of an `assembly_path`, counted from 0.
    seconds : float, optional
        How long the film takes [s], at least 0.2; default: 20 s, unless `speed` is given.
    speed : float, optional
        How much faster than real time the film is, in place of `seconds`.
    progress : callable, optional
        Called with the number of frames that are written, and of all.

    Returns
    -------
    pathlib.Path
        The file.

    Raises
    ------
    InputError
        When the dataset is of another kind, has no such run or no motion; when the ending is
        another one, the folder does not exist, the film would be too long, or an MP4 is asked for
        where neither the program ffmpeg nor OpenCV is installed.
    RunDirectoryError
        When the file cannot be written.

    Examples
    --------
    ``write_animation(path, "run.gif", run=2)``
    ``write_animation(recording, "recording.mp4", speed=4.0)``
    """
    target = Path(file)
    require_target(target, existing="replace", endings=tuple(FRAMES_PER_S))
    if seconds is not None and speed is not None:
        raise InputError("the length of a film and how fast it runs say the same: give one")
    scene = _scene(motion, run)
    ending = target.suffix.lower()
    moments, rate = _moments(scene.time, FRAMES_PER_S[ending], seconds, speed)
    require_film_writer(ending)
    with style.print_style(), atomic_path(target) as temporary:
        frames = _frames(scene, moments, rate, DOTS_PER_INCH[ending])
        if progress is not None:
            frames = _counted(frames, moments.size, progress)
        write_frames(temporary, ending, frames)
    return target


def _counted(
    frames: Iterator[Frame], total: int, progress: Callable[[int, int], None]
) -> Iterator[Frame]:
    for number, frame in enumerate(frames, 1):
        yield frame
        progress(number, total)


def _scene(motion: xr.Dataset, run: int) -> _Scene:
    require_kind(motion, "assembly_path trajectory")
    one, bodies = motion, "body"
    if "run" in motion.dims:
        runs = motion.sizes["run"]
        if not 0 <= run < runs:
            raise InputError(f"run={run}: the dataset has {runs} runs, counted from 0")
        one, bodies = motion.isel(run=run), "block"
        if "block_side_m" not in motion.attrs:
            raise InputError("the dataset has no attribute 'block_side_m': the size is unknown")
    one = one.transpose("time", bodies, ...)
    place = np.stack([one[name].values for name in "xy"], axis=-1, dtype=np.float64)
    if not np.isfinite(place).all(axis=-1).any():
        raise InputError("no sample holds a position: there is nothing to film")
    if motion.attrs.get("block_shape") == "disc":
        one = one.assign(theta=one["theta"] * np.nan)
    color = one["assembly"].values if "assembly" in one else np.arange(one.sizes[bodies])
    color = np.broadcast_to(color, place.shape[:2])
    side = motion.attrs.get("block_side_m")
    return _Scene(
        np.asarray(one["time"].values, dtype=np.float64),
        CM_PER_M * place,
        np.asarray(one["theta"].values, dtype=np.float64),
        np.asarray(color, dtype=np.int64),
        None if side is None else CM_PER_M * float(side),
        motion.attrs.get("block_width_m", side or 1.0) / (side or 1.0),
        arena_of(motion),
        poles_of(motion),
    )


def _moments(
    time: Floats, per_second: float, seconds: float | None, speed: float | None
) -> tuple[Floats, float]:
    """Return the time of every frame [s], and how much faster than real time that is."""
    lasts = float(time[-1] - time[0])
    if speed is None:
        seconds = 20.0 if seconds is None else seconds
        if not seconds >= SHORTEST_S:
            raise InputError(f"seconds={seconds:g}: a film takes at least {SHORTEST_S:g} s")
        count = max(2.0, round(seconds * per_second))
        rate = lasts / seconds
    else:
        if not (np.isfinite(speed) and speed > 0.0):
            raise InputError(
                f"speed must be positive (playback speed relative to real time), got {speed:g}"
            )
        count = np.floor(lasts * per_second / speed * (1.0 + 1e-12)) + 1.0
        rate = speed
    if count > MOST_FRAMES:
        least = lasts * per_second / MOST_FRAMES
        raise InputError(
            f"the film would take {count / per_second:.0f} s, and at most "
            f"{MOST_FRAMES / per_second:.0f} s are written: let it run at least "
            f"{np.ceil(least):g} times as fast as real time"
        )
    if speed is None:
        return np.linspace(time[0], time[-1], int(count)), rate
    return time[0] + np.arange(int(count)) * (speed / per_second), rate


def _frames(scene: _Scene, moments: Floats, rate: float, dots: int) -> Iterator[Frame]:
    """Draw what stays once, and what moves on top of it for every frame."""
    from matplotlib.collections import LineCollection, PolyCollection

    figure, ax = _stage(scene, rate, dots)
    canvas: Any = figure.canvas
    canvas.draw()
    empty = canvas.copy_from_bbox(figure.bbox)
    trails = LineCollection([], colors=style.MUTED, linewidths=0.8, alpha=0.7, zorder=2)
    bars = empty_bars()
    count = scene.place.shape[1]
    bodies = PolyCollection([], edgecolors=style.INK, linewidths=style.edge_width(count), zorder=3)
    pointers = LineCollection([], colors=style.INK, linewidths=0.9, zorder=4)
    clock = figure.text(0.04, 0.955, "", size=9.0, va="center")
    artists = (trails, bodies, bars, pointers)
    for artist in artists:
        ax.add_collection(artist, autolim=False)
    seen = _last_seen(scene)
    digits = 1 if rate < 10.0 else 0
    # The half of a side, or the radius of a disc.
    size = 0.015 * float(np.ptp(ax.get_xlim())) if scene.side is None else scene.side / 2.0
    for moment in moments:
        # A hair of rounding is forgiven.
        until = int(np.searchsorted(scene.time, moment + 1e-9 * max(1.0, abs(moment)), "right"))
        body = np.flatnonzero(seen[until - 1] >= 0)
        shown = list(zip(seen[until - 1][body].tolist(), body.tolist(), strict=True))
        first = int(np.searchsorted(scene.time, moment - TRAIL_S * rate))
        bodies.set_verts(_outlines(scene, seen[until - 1][body], body, size))
        bodies.set_facecolor([PALETTE[scene.color[one] % len(PALETTE)] for one in shown])
        if scene.pole is not None:
            x, y = scene.place[until - 1].T
            set_pole_bars(bars, x, y, scene.theta[until - 1], scene.pole, size)
        if count <= MOST_TRAILS:
            # NaN breaks the line.
            trails.set_segments([scene.place[first:until, body] for _, body in shown])
            pointers.set_segments([line for one in shown if (line := _pointer(scene, *one, size))])
        clock.set_text(f"t = {moment:.{digits}f} s")
        canvas.restore_region(empty)
        for artist in artists:
            ax.draw_artist(artist)
        figure.draw_artist(clock)
        yield np.asarray(canvas.buffer_rgba())[:, :, :3]


def _stage(scene: _Scene, rate: float, dots: int) -> tuple[Figure, Axes]:
    """Return the empty tank with its scale and the speed of the film.

    Axes without ticks and a fixed layout: a frame is drawn in some milliseconds.
    """
    figure = style.new_figure(width_mm=FILM_MM, height_mm=FILM_MM)
    figure.set_layout_engine("none")
    figure.set_dpi(dots)
    ax = figure.add_axes((0.03, 0.03, 0.94, 0.9))
    ax.set_axis_off()
    if draw_arena(ax, scene.arena) is None:
        # Everything that is ever seen, in a square.
        low, high = np.nanmin(scene.place, axis=(0, 1)), np.nanmax(scene.place, axis=(0, 1))
        half = 0.54 * float((high - low).max()) + (scene.side or 0.0) or 1.0
        xlim, ylim = np.column_stack([(low + high) / 2.0 - half, (low + high) / 2.0 + half])
        ax.set(xlim=xlim, ylim=ylim)
    draw_scale_bar(ax)
    words = "real time" if rate == 1.0 else f"{rate:.3g} × real time"
    figure.text(0.96, 0.955, words, size=8.0, va="center", ha="right")
    return figure, ax


def _last_seen(scene: _Scene) -> Integers:
    """Return the sample that shows each body at each time, -1 while it is not seen."""
    present = np.asarray(np.isfinite(scene.place).all(axis=-1))
    rows = np.arange(scene.time.size, dtype=np.int64)[:, None]
    last = np.maximum.accumulate(np.where(present, rows, -1), axis=0)
    for body in range(present.shape[1]):
        own = scene.time[present[:, body]]
        usual = float(np.median(np.diff(own))) if own.size > 1 else 0.0
        age = scene.time - scene.time[last[:, body]]
        # A body that is not seen stays in the picture for three of its usual intervals.
        last[age > 3.0 * usual * (1.0 + 1e-9), body] = -1
    return last


def _outlines(scene: _Scene, sample: Integers, body: Integers, size: float) -> list[Floats]:
    """Return the corners of blocks, or discs where side or orientation are unknown."""
    theta = scene.theta[sample, body]
    square = np.isfinite(theta) & (scene.side is not None)
    place = scene.place[sample, body][:, None]
    half = np.arctan(scene.slimness)
    corner = np.array([half, np.pi - half, np.pi + half, -half])
    angle = np.where(square, theta, 0.0)[:, None] + corner
    reach = size * np.hypot(1.0, scene.slimness)
    corners = place + reach * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    round_ = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    circles = place + size * np.stack([np.cos(round_), np.sin(round_)], axis=-1)
    return [corners[n] if one else circles[n] for n, one in enumerate(square)]


def _pointer(scene: _Scene, sample: int, body: int, size: float) -> list[Floats]:
    """Return the line from the middle of a body to its front, nothing where that is unknown."""
    theta = float(scene.theta[sample, body])
    if not np.isfinite(theta):
        return []
    reach = size if scene.side is not None else 2.0 * size
    ahead = np.array([np.cos(theta), np.sin(theta)])
    return [scene.place[sample, body], scene.place[sample, body] + reach * ahead]


def require_film_writer(ending: str) -> None:
    """Refuse a film that nothing on this machine can write.

    Parameters
    ----------
    ending : {".gif", ".mp4"}
        Its ending.

    Raises
    ------
    InputError
        Says what to install.

    Examples
    --------
    >>> require_film_writer(".gif")
    """
    if ending != ".mp4" or shutil.which("ffmpeg") is not None:
        return
    try:
        import cv2  # noqa: F401
    except ImportError as error:
        raise InputError(
            "an MP4 needs the program ffmpeg, or OpenCV: pip install 'driftwalk[track]'; or write "
            "a .gif"
        ) from error


def write_frames(path: Path, ending: str, frames: Iterator[Frame]) -> None:
    """Write frames as a film, one after another, so that they are never all in memory.

    Parameters
    ----------
    path : Path
        The file to make.
    ending : {".gif", ".mp4"}
        As what.
    frames : iterator of array, shape (rows, columns, 3)
        Frames of one size, at least one.

    Raises
    ------
    InputError
        When the encoder fails.

    Examples
    --------
    >>> write_frames(Path("a.gif"), ".gif", iter([frame]))  # doctest: +SKIP
    """
    if ending == ".gif":
        _write_gif(path, frames)
    elif shutil.which("ffmpeg") is not None:
        _write_by_ffmpeg(path, frames)
    else:
        _write_by_opencv(path, frames)


def _write_gif(path: Path, frames: Iterator[Frame]) -> None:
    from PIL import Image

    pictures = (Image.fromarray(np.ascontiguousarray(frame)) for frame in frames)
    next(pictures).save(
        path,
        format="GIF",
        save_all=True,
        append_images=pictures,
        duration=round(1000.0 / FRAMES_PER_S[".gif"]),
        loop=0,
    )


def _write_by_ffmpeg(path: Path, frames: Iterator[Frame]) -> None:
    first = next(frames)
    rows, columns = first.shape[:2]
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{columns}x{rows}"]
    made = ["-c:v", "h264", "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4"]
    rate = ["-r", f"{FRAMES_PER_S['.mp4']:g}"]
    command = ["ffmpeg", "-loglevel", "error", "-y", *raw, *rate, "-i", "-", *made, str(path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as ffmpeg:
        assert ffmpeg.stdin is not None
        assert ffmpeg.stderr is not None
        try:
            # A pipe that closes early is an encoder that failed, and says why below.
            with contextlib.suppress(BrokenPipeError):
                for frame in itertools.chain([first], frames):
                    ffmpeg.stdin.write(np.ascontiguousarray(frame).tobytes())
                ffmpeg.stdin.close()
        except BaseException:
            ffmpeg.kill()
            raise
        said = " ".join(ffmpeg.stderr.read().decode(errors="replace").split())
    if ffmpeg.returncode != 0:
        raise InputError(f"ffmpeg could not write the film: {said or ffmpeg.returncode}")


def _write_by_opencv(path: Path, frames: Iterator[Frame]) -> None:
    from driftwalk.core.extras import require_opencv

    cv2 = require_opencv("an MP4")
    first = next(frames)
    rows, columns = first.shape[:2]
    for codec in CODECS:
        code = cv2.VideoWriter.fourcc(*codec)
        writer = cv2.VideoWriter(str(path), code, FRAMES_PER_S[".mp4"], (columns, rows))
        if writer.isOpened():
            break
    else:
        raise InputError("this OpenCV writes no MP4: install the program ffmpeg, or write a .gif")
    try:
        for frame in itertools.chain([first], frames):
            # Blue first, as OpenCV has it.
            writer.write(np.ascontiguousarray(frame[:, :, ::-1]))
    finally:
        writer.release()
