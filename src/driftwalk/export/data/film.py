"""Motion as a film."""

from __future__ import annotations

from pathlib import Path

from driftwalk.export.data.motion import Motion


def write_film(motion: Motion, folder: Path, *, ending: str, speed: float = 1.0) -> Path:
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

    return write_animation(motion.recording, folder / f"{motion.name}.{ending}", speed=speed)
