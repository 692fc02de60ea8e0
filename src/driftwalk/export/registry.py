"""The targets of an export, by name. A new one is a function that writes, and its entry here."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from driftwalk.core.errors import InputError
from driftwalk.core.text.did_you_mean import did_you_mean
from driftwalk.export.data.targets import DATA_TARGETS
from driftwalk.export.figures.targets import FIGURE_TARGETS
from driftwalk.export.target import Source, Target, Verification


# A target's module is imported when it is used: help answers at once.
def _write_mujoco(source: Source, folder: Path) -> list[Path]:
    from driftwalk.export.simulators.mujoco import write_mujoco

    return write_mujoco(source, folder)


def _verify_mujoco(folder: Path) -> Verification:
    from driftwalk.export.simulators.mujoco import verify_mujoco

    return verify_mujoco(folder)


def _require_mujoco() -> None:
    from driftwalk.export.simulators.mujoco import require_mujoco

    require_mujoco()


def _write_webots(source: Source, folder: Path) -> list[Path]:
    from driftwalk.export.simulators.webots import write_webots

    return write_webots(source, folder)


def _verify_webots(folder: Path) -> Verification:
    from driftwalk.export.simulators.webots import verify_webots

    return verify_webots(folder)


def _write_gazebo(source: Source, folder: Path) -> list[Path]:
    from driftwalk.export.simulators.gazebo import write_gazebo

    return write_gazebo(source, folder)


def _verify_gazebo(folder: Path) -> Verification:
    from driftwalk.export.simulators.gazebo import verify_gazebo

    return verify_gazebo(folder)


def _require_compiler() -> None:
    from driftwalk.export.simulators.compiled import compiler

    compiler()


_SIMULATORS: Final = (
    Target(
        name="mujoco",
        gives="the tank as MJCF, the water as a Python module, and verify.py",
        write=_write_mujoco,
        verify=_verify_mujoco,
        require=_require_mujoco,
    ),
    Target(
        name="webots",
        gives="a world, a PROTO and a physics plugin in C",
        write=_write_webots,
        verify=_verify_webots,
        require=_require_compiler,
    ),
    Target(
        name="gazebo",
        gives="a world and a system plugin in C++",
        write=_write_gazebo,
        verify=_verify_gazebo,
        require=_require_compiler,
    ),
)
_ALL: Final = (*_SIMULATORS, *DATA_TARGETS, *FIGURE_TARGETS)
TARGETS: Final[dict[str, Target]] = {target.name: target for target in _ALL}
"""Every target by its name, in the order of the help."""


def target_named(name: str) -> Target:
    """Return a target.

    Raises
    ------
    InputError
        When there is none of this name; the message lists them.

    Examples
    --------
    >>> target_named("gazebo").gives
    'a world and a system plugin in C++'
    """
    if name in TARGETS:
        return TARGETS[name]
    raise InputError(
        f"there is no export to '{name}'{did_you_mean(name, TARGETS)}; "
        f"what can be made: {', '.join(TARGETS)}"
    )
