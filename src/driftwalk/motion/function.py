"""A Python function of the user as a motion model."""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np

from driftwalk.conditions.recorded import Conditions
from driftwalk.core.arrays import Floats, Keys
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.motion.camera import observe_worlds
from driftwalk.motion.protocol import (
    Values,
    WorldRandom,
    Worlds,
    in_words,
    world_batches,
    world_starts,
)
from driftwalk.motion.ranges import Range, given_by_name, range_parameter, with_given
from driftwalk.schema import Parameter
from driftwalk.simulation.initial import Start

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.conditions import Neighbours
    from driftwalk.model import Tank

Settings = Literal["one", "many"]
Positions = tuple[Floats, Floats] | tuple[Floats, Floats, Floats]
MotionFunction = Callable[..., Positions]


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything a function gets besides its parameters: the conditions of a batch of worlds.

    Attributes
    ----------
    times : ndarray, shape (samples,)
        When positions are wanted [s]: from 0 on, increasing, with the recording's gaps.
    worlds : int
        How many worlds to simulate.
    start : Start
        Pose and motion at time 0, arrays of shape (worlds,): ``x``, ``y`` [m], ``theta`` [rad]
        (random where the recording has no orientation), ``vx``, ``vy`` [m/s], ``omega`` [rad/s].
    random : WorldRandom
        Random numbers, one stream per world. Other sources make results depend on the order.
    tank : Tank
        The tank; ``tank.radius_m`` of a circle, ``tank.corners_m`` of other shapes.
    flow : xarray.Dataset or None
        The water's velocity, where the calibration was given one.
    neighbours : Neighbours or None
        The other bodies of the recording; ``neighbours.at(times)`` says where they are.
    """

    times: Floats
    worlds: int
    start: Start
    random: WorldRandom
    tank: Tank
    flow: xr.Dataset | None
    neighbours: Neighbours | None = None


class FunctionModel:
    """A motion model made of a Python function; see `motion_model`."""

    needs_flow = False

    def __init__(
        self, function: MotionFunction, parameters: tuple[Parameter, ...], *, settings: Settings
    ) -> None:
        self.name = str(getattr(function, "__name__", type(function).__name__))
        self.parameters = parameters
        self.function = function
        self.settings = settings

    def simulate(self, values: Values, like: Conditions, keys: Keys) -> Worlds:
        """Return one world per key; see `MotionModel.simulate`.

        Raises
        ------
        InputError
            When the function fails or returns something else than positions.
        """
        batches = world_batches(
            [values[one.name] for one in self.parameters],
            # Some 100 MB of positions for each call.
            most=max(4_000_000 // like.sample_time.size, 1),
            one_setting=self.settings == "one",
        )
        parts = [self._call(values, like, keys, batch) for batch in batches]
        return Worlds(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))

    def describe(self) -> dict[str, Any]:
        """Return its name, its parameters and a hash of its source, where there is one."""
        try:
            source = inspect.getsource(self.function)
        except (OSError, TypeError):
            source = ""
        return {
            "name": self.name,
            "parameters": [parameter.describe() for parameter in self.parameters],
            "source_sha256": hashlib.sha256(source.encode()).hexdigest() if source else None,
        }

    def facts(self, estimate: Mapping[str, float]) -> dict[str, Any]:  # noqa: ARG002
        """Return which function it was: its name, and a hash of its source where there is one."""
        source = self.describe()["source_sha256"]
        return {"model": self.name, **({} if source is None else {"model_source_sha256": source})}

    def _call(self, values: Values, like: Conditions, keys: Keys, batch: slice) -> Worlds:
        own = keys[batch]
        scene = Scene(
            like.sample_time, own.size, world_starts(like.start, own), WorldRandom(own), like.tank,
            like.flow, like.neighbours,
        )  # fmt: skip
        given = {one.name: np.asarray(values[one.name][batch]) for one in self.parameters}
        if self.settings == "one":
            passed: dict[str, Any] = {name: float(column[0]) for name, column in given.items()}
        else:
            passed = {name: column[:, None] for name, column in given.items()}
        try:
            found = self.function(scene, **passed)
        except Exception as error:
            raise InputError(
                f"{self._called(given)} failed: {type(error).__name__}: {error}"
            ) from error
        x, y, theta = self._positions(found, (own.size, like.sample_time.size), given)
        return observe_worlds(x, y, theta, like, own)

    def _called(self, given: Mapping[str, Floats]) -> str:
        words = in_words({name: float(column[0]) for name, column in given.items()})
        return f"the model {self.name}({words})"

    def _positions(
        self, found: Any, shape: tuple[int, int], given: Mapping[str, Floats]
    ) -> tuple[Floats, Floats, Floats | None]:
        if not isinstance(found, tuple) or len(found) not in (2, 3):
            raise InputError(
                f"{self._called(given)} returned {type(found).__name__}: return x, y or x, y, theta"
            )
        arrays: list[Floats] = []
        for name, values in zip(("x", "y", "theta"), found, strict=False):
            try:
                array = np.asarray(values, dtype=np.float64)
            except (TypeError, ValueError) as error:
                raise InputError(
                    f"{self._called(given)} returned a {name} that is no array of numbers: {error}"
                ) from error
            if array.shape != shape:
                raise InputError(
                    f"{self._called(given)} returned {name} of shape {array.shape}, expected "
                    f"{shape}: (scene.worlds, scene.times.size)"
                )
            arrays.append(array)
        return arrays[0], arrays[1], arrays[2] if len(arrays) == 3 else None


def function_model(
    function: MotionFunction,
    parameters: tuple[Parameter, ...],
    ranges: Mapping[str, Range],
    *,
    settings: Settings,
) -> FunctionModel:
    """Return a motion model made of a Python function; see `driftwalk.motion.motion_model`.

    Raises
    ------
    ConfigurationError
        When there is no parameter, a range is none, or the function does not take them.
    """
    if settings not in get_args(Settings):
        raise ConfigurationError(
            f"settings must be one of {', '.join(get_args(Settings))}, got {settings!r}"
        )
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):
        signature = None
    usual = {} if signature is None else _default_ranges(signature)
    named = with_given(usual, given_by_name(parameters, ranges))
    if not named:
        raise ConfigurationError("a motion model needs a parameter: speed=(0, 0.1, 'm/s')")
    try:
        if signature is not None:
            signature.bind(None, **{one.name: 0.0 for one in named})
    except TypeError as error:
        called = getattr(function, "__name__", "the function")
        names = ", ".join(one.name for one in named)
        raise ConfigurationError(
            f"{called}{signature} cannot be called with a scene and {names}: {error}"
        ) from error
    return FunctionModel(function, named, settings=settings)


def _default_ranges(signature: inspect.Signature) -> dict[str, Parameter]:
    """Return the parameters whose defaults are ranges: with a unit, as pairs are other things too.

    A default of two numbers without a unit may be a position or a size.
    """
    return {
        one.name: range_parameter(one.name, one.default)
        for one in signature.parameters.values()
        if one.kind is one.KEYWORD_ONLY and _is_range(one.default)
    }


def _is_range(default: Any) -> bool:
    if isinstance(default, Parameter):
        return True
    return isinstance(default, tuple) and len(default) == 3 and isinstance(default[2], str)
