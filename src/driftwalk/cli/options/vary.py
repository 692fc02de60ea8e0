"""The option ``--vary NAME=VALUES``: which inputs a sensitivity analysis compares."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Annotated, Any, Final, NamedTuple

from driftwalk.cli.options.shared import PANEL, option
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.core.units import parse_quantity

Vary = Annotated[
    list[str] | None,
    option(
        "--vary NAME=VALUES",
        help="Values to compare: blocks=2,3,4 or drag-coefficient=0:1.5:0.05. Repeatable.",
        panel=PANEL,
    ),
]


class Axis(NamedTuple):
    """An input that can be varied."""

    key: str
    """Key of the study that holds the list of its values."""
    unit: str
    """Unit of a number, empty for words."""
    whole: bool = False


AXES: Final[dict[str, Axis]] = {
    "tank": Axis("sensitivity.tank_diameter_m", "m"),
    "blocks": Axis("sensitivity.blocks", "1", whole=True),
    "flow": Axis("sensitivity.flow", ""),
    "latching": Axis("sensitivity.latching", ""),
    "hidden-face-drag": Axis("sensitivity.hidden_face_drag", ""),
    "drag-coefficient": Axis("sensitivity.drag_coefficient", "1"),
    "force-std": Axis("sensitivity.force_std_N", "N"),
}
MOST_VALUES: Final = 1_000_000
VARY_KEYS: Final = {f"vary {name}": axis.key for name, axis in AXES.items()}
"""From what an error calls the option to the key that it sets."""


def vary_overrides(given: Sequence[str]) -> dict[str, Any]:
    """Return the keys of the study that the options set.

    Parameters
    ----------
    given : sequence of str
        Such as ``"blocks=2,3,4"``, ``"drag-coefficient=0:1.5:0.05"`` (from, to, step),
        ``"latching=collision,connector"``.

    Raises
    ------
    InputError
        When there is no such input, it is named twice, or a value cannot be read.

    Examples
    --------
    >>> vary_overrides(["blocks=2:4:1", "force-std=0.2mN,1mN"])
    {'sensitivity.blocks': [2, 3, 4], 'sensitivity.force_std_N': [0.0002, 0.001]}
    """
    found: dict[str, Any] = {}
    for text in given:
        name, sign, values = text.partition("=")
        axis = AXES.get(name.strip().replace("_", "-"))
        if axis is None or not sign:
            raise InputError(
                f"--vary {text}: expected NAME=VALUES with a name out of {', '.join(AXES)}"
            )
        if axis.key in found:
            raise InputError(f"--vary {text}: {name} is varied twice; name all values at once")
        words = [word.strip() for word in values.split(",")]
        if not all(words):
            raise InputError(f"--vary {text}: a value is missing after '{name}='")
        try:
            found[axis.key] = [value for word in words for value in _values(word, axis)]
        except ConfigurationError as error:
            raise InputError(f"--vary {text}: {error}") from error
    return found


def _values(word: str, axis: Axis) -> Iterator[Any]:
    """Return the values of one word: itself, a number, or the numbers of a range."""
    if not axis.unit:
        yield word
        return
    parts = word.split(":")
    numbers = [parse_quantity(part, axis.unit) for part in parts]
    if len(numbers) == 3:
        numbers = _range(*numbers, parts=parts, unit=axis.unit)
    elif len(numbers) != 1:
        raise ConfigurationError(f"expected a number or FROM:TO:STEP, got '{word}'")
    for number in numbers:
        # The study refuses a part of a block.
        yield int(number) if axis.whole and number.is_integer() else number


def _range(
    first: float, last: float, step: float, *, parts: Sequence[str], unit: str
) -> list[float]:
    """Return the numbers of a range, end included, rounded to the decimals of the step."""
    shown = [f"{number:g}" + ("" if unit == "1" else f" {unit}") for number in (first, last, step)]
    bare = [_is_bare(part) for part in parts]
    # "0.4:0.6mN:0.2mN": whoever writes this means 0.4 mN.
    advice = "".join(
        f"; '{part}' without a unit is {text}"
        for part, text, alone in zip(parts, shown, bare, strict=True)
        if alone and not all(bare) and float(part)
    )
    if not (step > 0 and last >= first):
        raise ConfigurationError(
            f"no value from {shown[0]} to {shown[1]} in steps of {shown[2]}{advice}"
        )
    steps = (last - first) / step
    if steps > MOST_VALUES:
        raise ConfigurationError(
            f"a step of {shown[2]} gives more than {MOST_VALUES} values{advice}"
        )
    return [float(f"{first + k * step:.12g}") for k in range(math.floor(steps + 1e-6) + 1)]


def _is_bare(part: str) -> bool:
    """Whether a text is a number without a unit."""
    try:
        float(part)
    except ValueError:
        return False
    return True
