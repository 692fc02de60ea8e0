"""A finished calibration in a run directory, small and real, for the tests of pages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

import xarray as xr
from command_line import FLOW, RECORDING
from made_once import made_once

import driftwalk as dw
from driftwalk.core.files.rundir import RunDirectory
from driftwalk.core.provenance import manifest
from driftwalk.model import Study
from driftwalk.runs import Run

SEARCH = {
    "calibration.drag_coefficient_min": 0.2,
    "calibration.drag_coefficient_max": 0.6,
    "calibration.drag_coefficient_step": 0.1,
    "calibration.force_std_min_N": 0.2e-3,
    "calibration.force_std_max_N": 1e-3,
    "calibration.force_std_step_N": 0.2e-3,
    "calibration.replicates": 2,
    "calibration.refine": "none",
    "calibration.bootstrap": 0,
}


def _calibrate() -> dict[str, xr.Dataset]:
    """Return what the calibration took and found."""
    recording, flow = dw.tank30_recording(), dw.tank30_flow()
    found = dw.calibrate(recording, dw.apply_overrides(Study(), SEARCH), flow=flow, threads=1)
    return {"calibration.nc": found, "recording.nc": recording, "flow.nc": flow}


@cache
def _calibrated() -> dict[str, bytes]:
    """Return the files of the calibration, made once in a session."""
    return made_once(
        "finished run",
        lambda: {
            name: bytes(dataset.to_netcdf(engine="h5netcdf"))
            for name, dataset in _calibrate().items()
        },
    )


def write_finished_run(folder: Path) -> Path:
    """Calibrate on the bundled recording, 25 settings without refinement, and return the folder."""
    study = dw.apply_overrides(Study(), SEARCH)
    specification = {
        "study": study.to_dict(),
        "body": None,
        "kind": "calibration",
        "recording_sha256": "0" * 64,
        "flow_sha256": "0" * 64,
    }
    with RunDirectory(folder, specification=specification) as run:
        about = manifest(
            command=["driftwalk", "calibrate", str(RECORDING)],
            study=study.to_dict(),
            seeds={"calibration": study.calibration.seed},
            inputs={"recording": RECORDING, "flow": FLOW},
        )
        for name, content in _calibrated().items():
            run.write(name, content)
        run.write("figures/map.png", b"no picture")
        run.finish(about)
    return folder


@dataclass(frozen=True)
class StoredWork:
    """A run whose datasets are there already, without figures, as one that was received."""

    kind: str
    datasets: Mapping[str, xr.Dataset]
    study: Study = field(default_factory=Study)

    inputs: ClassVar[dict[str, Path]] = {}
    seeds: ClassVar[dict[str, int]] = {}

    def checked(self) -> StoredWork:
        return self

    def specification(self) -> dict[str, Any]:
        return {}

    def compute(self, run: Run) -> None:
        for name, dataset in self.datasets.items():
            run.keep(name, dataset)
        run.drawn = True
