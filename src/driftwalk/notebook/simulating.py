"""Simulate: a study in a flow, or what a fit or a calibration found, like a recording."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from driftwalk.conditions import study_for
from driftwalk.core.errors import InputError
from driftwalk.notebook.model_of import model_of

if TYPE_CHECKING:
    import numpy.typing as npt
    import xarray as xr

    from driftwalk.model import Study
    from driftwalk.simulation import Start
    from driftwalk.simulation.run import Backend


def simulate(
    model: Study | xr.Dataset,
    flow: xr.Dataset | None = None,
    *,
    like: xr.Dataset | None = None,
    body: str | None = None,
    sample_time: npt.ArrayLike | None = None,
    start: Start | None = None,
    replicates: int | None = None,
    seed: int | None = None,
    backend: Backend = "cpu",
    threads: int | None = None,
) -> xr.Dataset:
    """Simulate one block in a stirred tank.

    Parameters
    ----------
    model : Study or xarray.Dataset
        A study, a `fit` or a `calibration`.
    flow : xarray.Dataset, optional
        The water's velocity, a `flow_field`; a fit brings its own.
    like : xarray.Dataset, optional
        A `trajectory`: simulate what its camera would have recorded, in its tank, with its start,
        time stamps, gaps and noise.
    body : str, optional
        The body of that recording, where there are several.
    sample_time : array_like, shape (n,), optional
        Times of the samples [s]; not with `like`.
    start : Start, optional
        Pose and motion at time 0; not with `like`.
    replicates, seed : int, optional
        Over the study's values.
    backend : {"cpu", "reference"}
        See `driftwalk.simulation.simulate`; "reference" not with `like`.
    threads : int, optional
        Default: all processors. The result does not depend on it.

    Returns
    -------
    xarray.Dataset
        ``x``, ``y`` [m], ``theta`` [rad] with dimensions (replicate, time, body) and ``status``.

    Raises
    ------
    InputError
        When there is no flow, or an argument contradicts `like`: it and the study state two tanks
        or two blocks, say.

    Examples
    --------
    >>> import driftwalk as dw
    >>> run = dw.simulate(dw.Study(), dw.uniform_flow(0.0, 0.0), sample_time=[0.0, 0.1], seed=1)
    >>> run.sizes["time"]
    2
    """
    from driftwalk.conditions import simulate_like
    from driftwalk.simulation import simulate as simulate_study

    study, field, _ = model_of(model, flow, {})
    common: dict[str, Any] = {"replicates": replicates, "seed": seed, "threads": threads}
    if like is None:
        if body is not None:
            raise InputError("`body` names a body of the recording `like`, and none is given")
        return simulate_study(
            study, field, sample_time=sample_time, start=start, backend=backend, **common
        )
    if sample_time is not None or start is not None or backend != "cpu":
        raise InputError("with `like`, the recording gives times and start, in single precision")
    chosen = study_for([like], study, body=body)
    return simulate_like(chosen, field, like, body=body, **common)
