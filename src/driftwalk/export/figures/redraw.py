"""The figures of a finished run, drawn again from what it stores."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from driftwalk.core.errors import InputError
from driftwalk.core.files.run_layout import MANIFEST_FILE, run_file, state_of
from driftwalk.core.provenance import read_manifest
from driftwalk.schema.stores.contents import check_contents
from driftwalk.schema.stores.netcdf import open_netcdf

if TYPE_CHECKING:
    import xarray as xr


def draw_run(run: Path, folder: Path, formats: Sequence[str]) -> list[Path]:
    """Write all figures of a run.

    Parameters
    ----------
    run : Path
        The directory of a finished run.
    folder : Path
        Where to write.
    formats : sequence of {"png", "svg", "pdf", "csv"}
        File formats; ``csv`` holds the numbers that are drawn.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    InputError
        When it is no finished run, or one without figures.

    Examples
    --------
    >>> draw_run(Path("fit"), Path("paper"), ["pdf", "csv"])  # doctest: +SKIP
    """
    if state_of(run) != "finished":
        raise InputError(f"{run} is not the directory of a finished run, so it has no figures")
    stored = _Stored(run)
    written: list[Path] = []
    for draw in (_fit, _calibration, _models, _recovery, _assembly, _sensitivity):
        written += draw(stored, folder, formats)
    if not written:
        raise InputError(f"{run} is a run without figures")
    return written


class _Stored:
    """The datasets of a run."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        specification = read_manifest(folder / MANIFEST_FILE).get("specification")
        self.specification: dict[str, Any] = (
            specification if isinstance(specification, dict) else {}
        )

    def find(self, name: str) -> xr.Dataset | None:
        """Return a dataset, None where the run has none of this name."""
        path = run_file(self.folder, name)
        return None if path is None else check_contents(open_netcdf(path), path)

    def need(self, name: str) -> xr.Dataset:
        """Return a dataset that the run must have."""
        found = self.find(name)
        if found is None:
            raise InputError(f"{self.folder} lacks {name}: its figures cannot be drawn")
        return found

    @property
    def body(self) -> str | None:
        """The body of the recording that the run is about."""
        body = self.specification.get("body")
        return body if isinstance(body, str) else None


def _fit(run: _Stored, folder: Path, formats: Sequence[str]) -> list[Path]:
    from driftwalk.figures import write_check_figures, write_fit_figures, write_laws_figure
    from driftwalk.runs import steady_flows

    found = run.find("fit.nc")
    if found is None:
        return []
    written = write_fit_figures(
        folder,
        flow=steady_flows(found),
        trajectory=run.need("recording.nc"),
        body=run.body,
        simulated=found.attrs["simulated_recording"] == "yes",
        formats=formats,
    )
    if run.specification.get("compare_laws"):
        written += write_laws_figure(folder, fit=found, formats=formats)
    check = run.find("check.nc")
    if check is not None:
        written += write_check_figures(folder, check=check, formats=formats)
    return written


def _calibration(run: _Stored, folder: Path, formats: Sequence[str]) -> list[Path]:
    from driftwalk.figures import write_figures, write_model_calibration_figures

    searched, found = run.find("model_calibration.nc"), run.find("calibration.nc")
    if searched is not None:
        return write_model_calibration_figures(folder, calibration=searched, formats=formats)
    if found is None:
        return []
    return write_figures(
        found,
        flow=run.find("flow.nc"),
        trajectory=run.need("recording.nc"),
        folder=folder,
        body=run.body,
        formats=formats,
    )


def _models(run: _Stored, folder: Path, formats: Sequence[str]) -> list[Path]:
    from driftwalk.figures import write_model_figures

    found = run.find("comparison.nc")
    if found is None:
        return []
    return write_model_figures(folder, comparison=found, formats=formats)


def _recovery(run: _Stored, folder: Path, formats: Sequence[str]) -> list[Path]:
    from driftwalk.figures import write_model_recovery_figures, write_recovery_figures

    for name in ("recovery.nc", "model_recovery.nc"):
        found = run.find(name)
        if found is not None and found.attrs["kind"] == "model_recovery":
            return write_model_recovery_figures(folder, recovery=found, formats=formats)
        if found is not None:
            return write_recovery_figures(folder, recovery=found, formats=formats)
    return []


def _assembly(run: _Stored, folder: Path, formats: Sequence[str]) -> list[Path]:
    from driftwalk.figures import write_assembly_figures
    from driftwalk.runs import LABELS

    found = run.find("distribution.nc")
    if found is None:
        return []
    drawn = run.find("distribution_drawn.nc")
    return write_assembly_figures(
        folder,
        distribution=found,
        beside=drawn,
        labels=LABELS if drawn is not None else ("", ""),
        times=run.find("class_times.nc"),
        path=run.find("path.nc"),
        sizes=run.find("sizes.nc"),
        sizes_drawn=run.find("sizes_drawn.nc"),
        formats=formats,
    )


def _sensitivity(run: _Stored, folder: Path, formats: Sequence[str]) -> list[Path]:
    from driftwalk.runs import draw_sensitivity

    found = run.find("sensitivity.nc")
    if found is None:
        return []
    return draw_sensitivity(
        folder,
        reference=run.need("reference.nc"),
        sensitivity=found,
        components=run.find("components.nc"),
        formats=formats,
    )
