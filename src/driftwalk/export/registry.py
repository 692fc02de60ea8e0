"""The targets of an export, by name. A new one is a function that writes, and its entry here."""

from __future__ import annotations

from typing import Final

from driftwalk.core.did_you_mean import did_you_mean
from driftwalk.core.errors import InputError
from driftwalk.export.data.targets import DATA_TARGETS
from driftwalk.export.figures.targets import FIGURE_TARGETS
from driftwalk.export.target import Target

_ALL: tuple[Target, ...] = (*DATA_TARGETS, *FIGURE_TARGETS)
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
    >>> target_named("mujoco").takes
    'a calibrated block'
    """
    if name in TARGETS:
        return TARGETS[name]
    raise InputError(
        f"there is no export to '{name}'{did_you_mean(name, TARGETS)}; "
        f"what can be made: {', '.join(TARGETS)}"
    )
