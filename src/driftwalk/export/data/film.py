"""Motion as a film."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from driftwalk.export.data.motion import Motion

Progress = Callable[[int, int], None]


def write_film(
    motion: Motion,
    folder: Path,
    *,
    ending: str,
    speed: float = 1.0,
    progress: Progress | None = None,
) -> Path:
    """Write a film of what moved in its tank.

    Parameters
    ----------
    motion : Motion
        What moved.
    folder : Path
        Where to write.
    ending : {"mp4", "gif"}
        As what.
    speed : float
        How much faster than real time it is.
    progress : callable, optional
        Called with the number of frames that are written, and of all.

    Returns
    -------
    Path
        The film, ``NAME.mp4`` or ``NAME.gif``.

    Raises
    ------
    InputError
        When the speed is not above zero, the film would be too long, or nothing writes an MP4 here.

    Examples
    --------
    >>> write_film(Motion("recording", trajectory), Path("out"), ending="gif")  # doctest: +SKIP
    PosixPath('out/recording.gif')
    """
    from driftwalk.plot import write_animation

    file = folder / f"{motion.name}.{ending}"
    return write_animation(motion.recording, file, speed=speed, progress=progress)
