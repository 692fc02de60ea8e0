"""Study and flow that an answer stands on: what a finished run found, or a study says."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from driftwalk.core.errors import InputError
from driftwalk.schema.check import kind_name

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


class FoundModel(NamedTuple):
    """A model whose parameters are known."""

    study: Study
    flow: xr.Dataset
    """A `flow_field`."""
    uncertainty: xr.Dataset | None
    """The `fit` or `calibration` where parameters can be drawn from it."""


def model_of(
    source: Study | xr.Dataset,
    flow: xr.Dataset | None,
    overrides: Mapping[str, Any],
) -> FoundModel:
    """Return the model of a study, or of what a run found.

    Parameters
    ----------
    source : Study or xarray.Dataset
        A study, a `fit`, a `calibration`, or a `model_comparison` whose best model is the block.
    flow : xarray.Dataset or None
        A `flow_field` or a `fit`. A fit has its own; a calibration in a run directory has the one
        that is stored there.
    overrides : mapping
        Over the study, from ``"section.key"`` to the value.

    Raises
    ------
    InputError
        When there is no flow, or the dataset is of another kind.
    """
    from driftwalk.model import Study, apply_overrides
    from driftwalk.runs import read_found
    from driftwalk.schema.runs import kind_of

    if isinstance(source, Study):
        return FoundModel(apply_overrides(source, overrides), _flow(flow), None)
    if not hasattr(source, "attrs"):
        raise InputError(
            f"a study, a fit or a calibration is needed, got {source!r}; `motion_model` makes a "
            "motion model of a name, and xarray.open_dataset opens what a run directory holds, "
            "such as fit.nc"
        )
    kind = kind_of(source)
    if kind is None or not kind.gives_model:
        raise InputError(
            "a study, a fit or a calibration is needed, got a dataset of kind "
            f"{kind_name(source)!r}"
        )
    found = read_found(source)
    study = found.block_study(overrides)
    field = found.flow(study) if flow is None else _flow(flow)
    return FoundModel(study, field, found.uncertainty)


def flow_field_of(flow: xr.Dataset) -> xr.Dataset:
    """Return a flow field: the given one, or that of a given fit."""
    from driftwalk.runs import flow_of_result

    held = flow_of_result(flow)
    return flow if held is None else held


def _flow(flow: xr.Dataset | None) -> xr.Dataset:
    if flow is None:
        raise InputError("a study says nothing of the water: give `flow`, a flow field or a fit")
    return flow_field_of(flow)
