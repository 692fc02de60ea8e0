"""The run directory of a calibration, read as the start of further work."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from driftwalk.core.errors import InputError
from driftwalk.core.run_layout import faults_of, run_file, state_of
from driftwalk.schema.calibration import is_block
from driftwalk.schema.contents import check_contents
from driftwalk.schema.facts import sentences
from driftwalk.schema.netcdf import open_netcdf

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


@dataclass(frozen=True)
class Calibrated:
    """Results of a finished calibration.

    Attributes
    ----------
    study : Study
        Its study, with the drag coefficient and the force_std that it found.
    flow : xarray.Dataset
        The flow field that it used.
    calibration : xarray.Dataset
        The `calibration`.
    region : xarray.Dataset or None
        The same where it has a joint region, None where it was made without a bootstrap.
    files : dict of str to Path
        The files that were read, by their role.
    warnings : list of str
        Warnings of the calibration.
    """

    study: Study
    flow: xr.Dataset
    calibration: xr.Dataset
    region: xr.Dataset | None
    files: dict[str, Path]
    warnings: list[str]


def read_calibrated(folder: Path) -> Calibrated:
    """Read the run directory of a finished calibration.

    Parameters
    ----------
    folder : Path
        As `driftwalk calibrate --out` made it.

    Returns
    -------
    Calibrated
        Study, flow and calibration of the run.

    Raises
    ------
    InputError
        When it is no run, the calibration has not come to its end, or it is a run of another kind.

    Examples
    --------
    >>> read_calibrated(Path("run")).study.forces.drag_coefficient  # doctest: +SKIP
    0.39
    """
    from driftwalk.conditions import estimated_study
    from driftwalk.flow import load_flow

    files = {"calibration": folder / "calibration.nc", "flow": folder / "flow.nc"}
    _require_finished(folder, files)
    found = _read(files["calibration"])
    if not is_block(found):
        model = found.attrs.get("model", "of a user")
        raise InputError(
            f"{files['calibration']} is about the model {model}, and "
            "self-assembly simulates blocks: give a calibration of the block"
        )
    study = estimated_study(found, source=f"{files['calibration']}: its study")
    flow = load_flow(files["flow"], arena=study.tank.to_arena(), own_flags="keep")
    region = found if "region_level" in found else None
    faults = faults_of(folder, [path.name for path in files.values()])
    return Calibrated(study, flow, found, region, files, [*faults, *sentences(found, "warning")])


def _require_finished(folder: Path, files: dict[str, Path]) -> None:
    state = state_of(folder)
    if state == "unfinished":
        raise InputError(
            f"{folder} holds a calibration that is not finished: run its command again, which "
            "continues it"
        )
    if state == "new":
        what = "is not a run directory" if folder.exists() else "does not exist"
        raise InputError(
            f"{folder} {what}: give the directory of a finished calibration, or a flow "
            "field (`flow`)"
        )
    if (folder / "fit.nc").is_file() and not files["calibration"].is_file():
        raise InputError(
            f"{folder} holds a fit, not a calibration: calibrate on its flow {files['flow']} "
            "(`flow` of `calibrate`) and give that run, or give that flow (`flow`) and the fit's "
            "own numbers (`forces.drag_coefficient`, `forces.force_std_N`, "
            "`forces.force_interval_s`)"
        )
    for role, path in files.items():
        if run_file(folder, path.name) is None:
            raise InputError(
                f"{folder} holds a finished run, but no calibration: its {role} ({path.name}) is "
                "not there"
            )


def _read(path: Path) -> xr.Dataset:
    found = check_contents(open_netcdf(path), path)
    if found.attrs.get("kind") != "calibration":
        raise InputError(f"{path} is not a calibration: its kind is {found.attrs.get('kind')!r}")
    return found
