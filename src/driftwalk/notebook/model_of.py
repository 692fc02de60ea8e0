"""Study and flow that an answer stands on: what a fit or a calibration found."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from driftwalk.core.errors import InputError
from driftwalk.core.run_layout import MANIFEST_FILE, run_file

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


class FoundModel(NamedTuple):
    """A model whose parameters are known."""

    study: Study
    flow: xr.Dataset
    """A `flow_field`."""
    calibration: xr.Dataset | None
    """The `calibration`, where the model is from one."""


def model_of(
    source: Study | xr.Dataset,
    flow: xr.Dataset | None,
    overrides: Mapping[str, Any],
) -> FoundModel:
    """Return the model of a study, a fit or a calibration.

    Parameters
    ----------
    source : Study or xarray.Dataset
        A study, a `fit` or a `calibration`.
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
    from driftwalk.conditions import estimated_study
    from driftwalk.likelihood import fitted_flow
    from driftwalk.model import Study, apply_overrides
    from driftwalk.schema.calibration import is_block
    from driftwalk.schema.earlier import current_form

    if isinstance(source, Study):
        return FoundModel(apply_overrides(source, overrides), _flow(flow), None)
    if not hasattr(source, "attrs"):
        raise InputError(
            f"a study, a fit or a calibration is needed, got {source!r}; `motion_model` makes a "
            "motion model of a name"
        )
    source = current_form(source)
    kind = source.attrs.get("kind")
    if kind not in ("fit", "calibration"):
        raise InputError(
            f"a study, a fit or a calibration is needed, got a dataset of kind {kind!r}"
        )
    if kind == "calibration" and not is_block(source):
        raise InputError(
            f"the calibration is about the model {source.attrs.get('model', 'of a user')}: the "
            "tank simulates blocks, so give a calibration of the block"
        )
    study = estimated_study(source, overrides)
    if kind == "fit":
        return FoundModel(study, fitted_flow(source) if flow is None else _flow(flow), None)
    field = _stored_flow(source, study) if flow is None else _flow(flow)
    return FoundModel(study, field, source)


def flow_field_of(flow: xr.Dataset) -> xr.Dataset:
    """Return a flow field: the given one, or that of a given fit."""
    from driftwalk.likelihood import fitted_flow

    return fitted_flow(flow) if flow.attrs.get("kind") == "fit" else flow


def _flow(flow: xr.Dataset | None) -> xr.Dataset:
    if flow is None:
        raise InputError("a study says nothing of the water: give `flow`, a flow field or a fit")
    return flow_field_of(flow)


def _stored_flow(calibration: xr.Dataset, study: Study) -> xr.Dataset:
    """Return the flow field that is stored with a calibration in its run directory."""
    from driftwalk.flow import load_flow

    folder = run_folder(calibration)
    if folder is None:
        raise InputError(
            "a calibration does not hold the flow field that it used: give `flow`, or calibrate "
            "with `folder`"
        )
    path = run_file(folder, "flow.nc")
    if path is None:
        raise InputError(f"{folder} lacks flow.nc: give `flow`")
    return load_flow(path, arena=study.tank.to_arena(), own_flags="keep")


def run_folder(found: xr.Dataset) -> Path | None:
    """Return the run directory that a dataset was read from, None where it is from none."""
    source = found.encoding.get("source")
    if source is None:
        return None
    folder = Path(source).parent
    return None if run_file(folder, MANIFEST_FILE) is None else folder
