"""Choose a motion model: one of the family by its name, or a function, file or program."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

from driftwalk.core.errors import ConfigurationError
from driftwalk.motion.external_program.program import TIMEOUT_S, ProgramModel
from driftwalk.motion.family.members import MEMBERS, Member
from driftwalk.motion.family.particle import NEIGHBOURS, ParticleModel, usual_parameters
from driftwalk.motion.family.parts import PARTS, Part
from driftwalk.motion.function import MotionFunction, Settings, function_model
from driftwalk.motion.model_file import SUFFIX, model_of_file
from driftwalk.motion.protocol import MotionModel
from driftwalk.motion.ranges import given_by_name, known_value, ranged
from driftwalk.schema import Parameter

COMMAND: Final = "command:"
"""Beginning of the address of a program."""


def is_family_name(model: str) -> bool:
    """Return whether a text is a name of the family, and not the address of a file or program.

    Parameters
    ----------
    model : str
        The text.

    Examples
    --------
    >>> is_family_name("run_rest+wall"), is_family_name("mine.py:tumbler")
    (True, False)
    """
    return not model.startswith(COMMAND) and SUFFIX not in model


def feels_others(model: str | MotionModel | None) -> bool:
    """Return whether a model, or one of this name, needs the other bodies of a recording.

    Parameters
    ----------
    model : str, MotionModel or None
        The model; None is the block.

    Examples
    --------
    >>> feels_others("run_rest+wall+neighbours"), feels_others("run_rest+wall")
    (True, False)
    """
    if isinstance(model, str):
        return is_family_name(model) and NEIGHBOURS in model.split("+")
    return isinstance(model, ParticleModel) and model.feels_others


def motion_model(
    model: str | MotionFunction,
    /,
    *parameters: Parameter,
    settings: Settings = "one",
    clearance: float | None = None,
    timeout: float | None = None,
    **choices: Any,
) -> MotionModel:
    """Return a motion model: one of the family by its name, or a function, file or program.

    A name is a member of the family and parts that are added to it, "run_rest+wall"; `models`
    lists the members with their parameters. A parameter may get a value that is known, and is then
    not searched, or another range.

    A function is called as ``function(scene, speed=0.05, tumble_rate=1.2)``. `Scene` holds the
    times at which positions are wanted, the start, the number of worlds, and random numbers with
    one stream per world. The function returns the true positions ``x, y`` [m], or ``x, y, theta``
    [rad], as arrays of shape ``(scene.worlds, scene.times.size)``; driftwalk adds the noise, the
    resolution and the gaps of the recording, forms steps and compares. A row with NaN is a world
    that failed; the others count.

    All worlds of a call have the same parameters, which arrive as floats. With ``settings="many"``
    they arrive as columns of shape (worlds, 1), and one call simulates many settings: worth it for
    a function that steps through time in a loop.

    A function may hold the ranges itself, as defaults of its keywords, with a unit:
    ``def tumbler(scene, *, speed=(0.01, 0.1, "m/s"))``. A given range replaces such a default.

    A text such as "mine.py:tumbler" is a Python file and a name in it: a function, a motion model,
    or a class that makes one without arguments. The file may import the ones next to it.

    A text such as "command:./simulator fast" is a program, in any language. It names its parameters
    with their ranges, and answers requests for worlds, one line of JSON each. It is started in the
    current folder, once per thread that asks, and has the rights of this process.

    Parameters
    ----------
    model : str or callable
        The name, the function, the file with a name, or the command.
    *parameters : Parameter
        Parameters with a step, a scale or a label of their own.
    settings : {"one", "many"}
        Of a function: whether the worlds of a call share one setting of the parameters.
    clearance : float, optional
        Of the family: distance of the recorded point from the wall at contact [m]. Left out, a
        simulation takes 0 and a calibration the recording's.
    timeout : float, optional
        Of a program: longest time that an answer may take [s], default 60.
    **choices : tuple or float
        The other parameters by name: ``(low, high)`` or ``(low, high, unit)``; of the family also a
        value that is known.

    Returns
    -------
    MotionModel
        What `calibrate` takes: a `ParticleModel`, a `FunctionModel`, the model of a file, or a
        `ProgramModel`.

    Raises
    ------
    ConfigurationError
        When there is no such member, part, parameter, file or program, a range is none, or the
        function does not take the parameters.
    InputError
        When a program does not name its parameters.

    Notes
    -----
    Random numbers are to come from ``scene.random`` alone, those of a program from a generator per
    world that starts with its seed. `driftwalk.testing.MotionModelContract` tells whether a model
    keeps to it.

    Examples
    --------
    >>> import driftwalk as dw
    >>> model = dw.motion_model("active", turn_rate=0.0, speed=(0.01, 0.1, "m/s"))
    >>> [parameter.name for parameter in model.parameters]
    ['speed', 'rotational_diffusion']
    >>> def diffuse(scene, *, diffusivity):
    ...     spread = np.sqrt(2 * diffusivity * np.diff(scene.times, prepend=0.0))
    ...     x, y = (np.cumsum(spread * scene.random.normal(spread.size), axis=1) for _ in "xy")
    ...     return scene.start.x[:, None] + x, scene.start.y[:, None] + y
    >>> dw.motion_model(diffuse, diffusivity=(1e-6, 1e-4, "m2/s")).parameters[0].key
    'diffusivity_m2_s'
    """
    if not isinstance(model, str):
        if not callable(model):
            raise ConfigurationError(
                f"a motion model is made of a name or a function, got {type(model).__name__}"
            )
        _refuse(model="a function", clearance=clearance, timeout=timeout)
        return function_model(model, parameters, choices, settings=settings)
    if model.startswith(COMMAND):
        _refuse(model="a program", clearance=clearance)
        if settings != "one":
            raise ConfigurationError("a program gets one setting at a time: leave out `settings`")
        limit = TIMEOUT_S if timeout is None else timeout
        command = model.removeprefix(COMMAND)
        return ProgramModel(command, given_by_name(parameters, choices), timeout=limit)
    if SUFFIX in model:
        _refuse(model="a model in a file", clearance=clearance, timeout=timeout)
        return model_of_file(model, parameters, choices, settings)
    _refuse(model=model, settings=settings, timeout=timeout)
    return family_model(model, *parameters, clearance=clearance, **choices)


def _refuse(
    *,
    model: str,
    clearance: float | None = None,
    settings: Settings = "one",
    timeout: float | None = None,
) -> None:
    """Refuse what a kind of model has no use for."""
    if clearance is not None:
        raise ConfigurationError(f"{model} keeps its own distance from the wall: no `clearance`")
    if settings != "one":
        raise ConfigurationError(f"{model} takes many settings anyway: leave out `settings`")
    if timeout is not None:
        raise ConfigurationError("only a program has a time limit: leave out `timeout`")


Choice = float | tuple[float, float] | tuple[float, float, str]
"""A known value, or a range with or without its unit."""


def family_model(
    name: str, /, *parameters: Parameter, clearance: float | None = None, **choices: Choice
) -> ParticleModel:
    """Return a member of the family of self-propelled bodies, with parts.

    Parameters
    ----------
    name : str
        A member, then parts: "active", "run_rest+wall", "burst_coast+wall+follow". A hyphen counts
        as an underscore.
    *parameters : Parameter
        Parameters of the member with a range, step or scale of their own.
    clearance : float, optional
        Distance of the recorded point from the wall at contact [m]: half the body's width. Left
        out, a simulation takes 0 and a calibration of many parameters the recording's.
    **choices : float or tuple
        Of the member's parameters by name: a value that is known, or a range ``(low, high)`` or
        ``(low, high, unit)``. The others keep their wide ranges.

    Raises
    ------
    ConfigurationError
        When there is no such member, part or parameter, or a value or range makes no sense.

    Examples
    --------
    >>> model = family_model("run-tumble+wall", turn_rate=0.0, speed=(0.01, 0.1))
    >>> model.name, len(model.parameters), model.parameters[0].high
    ('run_tumble+wall', 8, 0.1)
    """
    member, parts = _member_and_parts(name)
    if clearance is not None and not (math.isfinite(clearance) and clearance >= 0.0):
        raise ConfigurationError(f"clearance is {clearance}, expected a length from 0 m on")
    usual = usual_parameters(member, parts)
    given: Mapping[str, Any] = given_by_name(parameters, choices)
    for unknown in given.keys() - usual.keys():
        raise ConfigurationError(
            f"the model {name} has no parameter {unknown!r}; it has {', '.join(usual)}"
        )
    fixed = {
        key: known_value(usual[key], choice)
        for key, choice in given.items()
        if not isinstance(choice, tuple | Parameter)
    }
    searched = tuple(
        _ranged(one, given[key]) if key in given else one
        for key, one in usual.items()
        if key not in fixed
    )
    return ParticleModel(member, parts, searched, fixed=fixed, clearance=clearance)


def _member_and_parts(name: str) -> tuple[Member, tuple[Part, ...]]:
    first, *rest = name.strip().replace("-", "_").split("+")
    if first not in MEMBERS:
        raise ConfigurationError(
            f"there is no motion model {first!r}; there are {', '.join(MEMBERS)}"
        )
    for part in rest:
        if part not in PARTS:
            raise ConfigurationError(
                f"a motion model has no part {part!r}; there are {', '.join(PARTS)}"
            )
    if len(set(rest)) < len(rest):
        raise ConfigurationError(f"a part of {name} is named twice")
    member = MEMBERS[first]
    if unfit := [part for part in rest if member.kind == "inertial" and PARTS[part].parameters]:
        raise ConfigurationError(
            f"{first} has no heading: it takes the parts flow and reflect, not {', '.join(unfit)}"
        )
    if "reverse" in rest and member.name == "active":
        raise ConfigurationError(
            f"{first} has one bout without end, so none begins with a reversal: leave the part "
            "reverse out"
        )
    return member, tuple(PARTS[part] for part in rest)


def _ranged(usual: Parameter, choice: Parameter | tuple[Any, ...]) -> Parameter:
    """Return the parameter with another range, which has nothing below 0 if the usual has not."""
    chosen = ranged(usual, choice)
    if chosen.low < 0.0 <= usual.low:
        raise ConfigurationError(f"{usual.name}: a value below 0 [{usual.unit}] makes no sense")
    return chosen


def models() -> Mapping[str, Member]:
    """Return the family of self-propelled motion models: members by name.

    Each has a ``sentence``, a ``formula``, a ``source`` and ``parameters``, which have a unit, a
    range and a ``meaning``. `motion_model` makes one, with parts: "run_rest+wall".

    Examples
    --------
    >>> import driftwalk as dw
    >>> list(dw.models())
    ['inertial', 'active', 'run_tumble', 'run_rest', 'burst_coast', 'two_state']
    >>> dw.models()["run_rest"].sentence
    'Runs and rests in turn: beetles, mice, robots that stop.'
    """
    return MEMBERS
