"""`driftwalk demo`: the main job on the bundled recording."""

from __future__ import annotations

from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from driftwalk.cli.calibrate import Overwrite, Threads, print_answer, summary
from driftwalk.cli.options import Json
from driftwalk.cli.output import print_json, print_note

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study

# A coarser search that still finds the optimum: for a quick look and for tests.
QUICK = {
    "calibration.drag_coefficient_min": 0.2,
    "calibration.drag_coefficient_max": 0.6,
    "calibration.force_std_min_N": 0.2e-3,
    "calibration.force_std_max_N": 1.0e-3,
    "calibration.force_std_step_N": 0.1e-3,
    "calibration.replicates": 1,
    "calibration.refined_replicates": 2,
    "calibration.bootstrap": 20,
}


def demo(
    out: Annotated[Path, typer.Option("--out", "-o", metavar="DIR", help="Run directory.")] = Path(
        "demo"
    ),
    quick: Annotated[
        bool, typer.Option("--quick", help="A small part of the search: seconds, not minutes.")
    ] = False,
    threads: Threads = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Calibrate a bundled recording, from file to figures.

    The recording was simulated by another engine (ODE), so that the truth is known; its true flow
    field is used. The result is printed beside the truth.
    """
    from driftwalk.cli.calibration_run import Work, run_calibration
    from driftwalk.core.run_layout import state_of
    from driftwalk.datasets import tank30_flow, tank30_recording

    if out.is_dir() and state_of(out) == "finished" and not overwrite:
        print_note(f"{out} holds a finished run (--overwrite starts anew); this is what it found")
        found = _read(out / "calibration.nc")
    else:
        folder = files("driftwalk.datasets") / "tank30_ode_a"
        with as_file(folder / "recording.csv") as path, as_file(folder / "flow_true.csv") as flow:
            work = Work(
                tank30_recording(),
                demo_study(quick=quick),
                tank30_flow(),
                None,
                {"recording": path, "flow": flow},
                threads,
            )
            found = run_calibration(work, out, overwrite=overwrite)
    if json:
        print_json({**summary(found), "truth": _truth()})
        return
    print_answer(found, out)
    truth = _truth()
    print(
        f"the truth              C_d = {truth['drag_coefficient']:g}, σ_F = "
        f"{1e3 * truth['force_std_N']:g} mN drawn anew every "
        f"{1e3 * truth['force_interval_s']:g} ms"
    )


def demo_study(*, quick: bool) -> Study:
    """Return the study of the demo: the wall and the force interval are those of the recording."""
    from driftwalk.datasets import tank30_truth
    from driftwalk.model import Study, apply_overrides

    truth = tank30_truth()
    known = {
        "forces.force_interval_s": truth["force_interval_s"],
        "tank.wall_friction": truth["wall_friction"],
        "tank.wall_restitution": truth["wall_restitution"],
    }
    return apply_overrides(Study(), {**known, **(QUICK if quick else {})})


def _truth() -> dict[str, float]:
    from driftwalk.datasets import tank30_truth

    truth = tank30_truth()
    return {key: truth[key] for key in ("drag_coefficient", "force_std_N", "force_interval_s")}


def _read(path: Path) -> xr.Dataset:
    import xarray as xr

    with xr.open_dataset(path, engine="h5netcdf") as dataset:
        return dataset.load()
