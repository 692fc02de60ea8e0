"""Choose a motion model: one of the family by its name, or a Python function of the user's."""

from __future__ import annotations

from typing import Any

from driftwalk.core.errors import ConfigurationError
from driftwalk.motion.family import ParticleModel, family_model
from driftwalk.motion.function import (
    FunctionModel,
    MotionFunction,
    Settings,
    function_model,
)
from driftwalk.schema import Parameter


def motion_model(
    model: str | MotionFunction,
    /,
    *parameters: Parameter,
    settings: Settings = "one",
    clearance: float = 0.0,
    **choices: Any,
) -> ParticleModel | FunctionModel:
    """Return a motion model: one of the family by its name, or one made of a Python function.

    A name is a member of the family and parts that are added to it, "run_rest+wall"; `models`
    lists the members with their parameters. A parameter may get a value that is known, and is then
    not searched, or a range of its own.

    A function is called as ``function(scene, speed=0.05, tumble_rate=1.2)``. `Scene` holds the
    times at which positions are wanted, the start, the number of worlds, and random numbers with
    one stream per world. The function returns the true positions ``x, y`` [m], or ``x, y, theta``
    [rad], as arrays of shape ``(scene.worlds, scene.times.size)``; driftwalk adds the noise, the
    resolution and the gaps of the recording, forms steps and compares. A row with NaN is a world
    that failed; the others count.

    All worlds of a call have the same parameters, which arrive as floats. With ``settings="many"``
    they arrive as columns of shape (worlds, 1), and one call simulates many settings: worth it for
    a function that steps through time in a loop.

    Parameters
    ----------
    model : str or callable
        The name, or the function.
    *parameters : Parameter
        Parameters with a step, a scale or a label of their own.
    settings : {"one", "many"}
        Of a function: whether the worlds of a call share one setting of the parameters.
    clearance : float
        Of the family: distance of the recorded point from the wall at contact [m].
    **choices : tuple or float
        The other parameters by name: ``(low, high)`` or ``(low, high, unit)``; of the family also a
        value that is known.

    Returns
    -------
    ParticleModel or FunctionModel
        What `calibrate` takes.

    Raises
    ------
    ConfigurationError
        When there is no such member, part or parameter, a range is none, or the function does not
        take the parameters.

    Notes
    -----
    Random numbers are to come from ``scene.random`` alone. `driftwalk.testing.MotionModelContract`
    tells whether a model keeps to it.

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
    if isinstance(model, str):
        if settings != "one":
            raise ConfigurationError(f"{model} takes many settings anyway: leave out `settings`")
        return family_model(model, *parameters, clearance=clearance, **choices)
    if not callable(model):
        raise ConfigurationError(
            f"a motion model is made of a name or a function, got {type(model).__name__}"
        )
    if clearance:
        raise ConfigurationError("a function keeps its own distance from the wall: no `clearance`")
    return function_model(model, parameters, choices, settings=settings)
