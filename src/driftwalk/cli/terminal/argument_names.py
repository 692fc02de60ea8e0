"""From the arguments that a message of the library names to the options of the command line.

A message names an argument in backquotes, as in Python: `body`, `columns={"t": "time:ms"}`,
`start` of `load`, `assembly.blocks` for a key of the study.
"""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Mapping
from typing import Any, Final

from driftwalk.core.study_keys import BOND_FORCE, TABLES


def option_of(name: str) -> str:
    """Return the option of the command line for a name of these tables.

    Examples
    --------
    >>> option_of("force_std"), option_of("tank_diameter")
    ('--force-std', '--tank')
    """
    return "--tank" if name == "tank_diameter" else f"--{name.replace('_', '-')}"


_SAME: Final = (
    "angle backend body box cell_size cells columns delimiter flow format frame_interval "
    "header_line heading host inertia keypoint length_unit mass max_speed "
    "min_confidence min_count missing port position_noise replicate seed sheet side step_interval "
    "rounds study tank theta topic up window worlds x y y_axis"
)
_WITHOUT: Final = (
    "area block_length body_b clearance folder like noise outlier_threshold seconds "
    "sample_time settings timeout"
)
OPTIONS: Final[dict[str, str | None]] = {
    **{name: option_of(name) for name in _SAME.split()},
    **dict.fromkeys(_WITHOUT.split()),
    "arena": "--tank",
    "block": "--side",
    "diameter": "--tank",
    "frame_rate": "--fps",
    "metres_per_pixel": "--scale",
    "origin": "--tank",
    "parameters": "--parameter",
    "rate": "--fps",
    "selection_runs": "--runs",
    "start": "--from",
    "stop": "--to",
    "variables": "--flow-variables",
    BOND_FORCE: "--bond-rate",
    # The tables have most keys in common, each by the same name in all of them.
    **{key: option_of(name) for table in TABLES for name, key in table.items()},
}
"""From an argument, or a key of the study, to its option; None where there is no option."""

WHOLE: Final[dict[str, str]] = {
    'arena={"shape": "circle", "diameter_m": 0.3}': "--tank",
    'existing="replace"': "--overwrite",
    "overwrite=True": "--overwrite",
    'sort="sort"': "--sort",
}
"""From an argument with its value to an option, where the option does not take that value."""

MESSAGES: Final = frozenset({"findings", "interrupted", "wall_left_out", "warning", "warnings"})
"""Keys of JSON whose values are messages of the library."""

# A command has one list of options: it need not say of which function the argument is.
_ARGUMENT: Final = re.compile(r"`(([a-z_]+(?:\.[A-Za-z_]+)?)(?:=([^`]*))?)`(?: of `[a-z_]+`)?")


def to_options(message: str) -> str:
    """Return a message with options in place of the arguments that it names.

    Parameters
    ----------
    message : str
        A message of the library. Words in backquotes that are no argument stay as they are.

    Examples
    --------
    >>> to_options('name one with `columns={"body": "NAME"}`, or keep a part (`start` of `load`)')
    'name one with --columns body=NAME, or keep a part (--from)'
    """
    return _ARGUMENT.sub(_option, message)


def in_options(values: Any) -> Any:
    """Return what a command prints as JSON, with options in its messages.

    Parameters
    ----------
    values : mapping, list or another value of JSON
        Messages are the texts under the keys `MESSAGES`, at any depth; everything else is data and
        stays as it is.

    Examples
    --------
    >>> in_options({"body": "`x`", "warnings": ["give `frame_rate`"]})
    {'body': '`x`', 'warnings': ['give --fps']}
    """
    if isinstance(values, Mapping):
        return {
            key: _messages(value) if key in MESSAGES else in_options(value)
            for key, value in values.items()
        }
    return [in_options(value) for value in values] if isinstance(values, list) else values


def _messages(value: Any) -> Any:
    if isinstance(value, str):
        return to_options(value)
    return [_messages(one) for one in value] if isinstance(value, list) else value


def _option(match: re.Match[str]) -> str:
    whole, name, value = match.groups()
    if whole in WHOLE:
        return WHOLE[whole]
    if name not in OPTIONS:
        return match[0]
    option = OPTIONS[name]
    if option is None:
        return str(whole)
    if value is None:
        return option
    try:
        words = _words(json.loads(value))
        if name == "tank":
            # The command line takes a bare size.
            words = words.removeprefix("circle:").removeprefix("rect:")
        return f"{option} {shlex.quote(words)}"
    except json.JSONDecodeError:
        return match[0]


def _words(value: Any) -> str:
    """Return the value of an argument as it is written behind its option."""
    if isinstance(value, Mapping):
        return ",".join(f"{key}={part}" for key, part in value.items())
    return str(value)
