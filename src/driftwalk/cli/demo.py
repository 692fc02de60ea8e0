"""`driftwalk demo`: the main job on the bundled recording."""

from __future__ import annotations

from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from driftwalk.cli.options.shared_types import Json, Overwrite, Threads, flag, optional
from driftwalk.cli.terminal.output import print_json, print_note
from driftwalk.cli.terminal.progress import reported
from driftwalk.core.progress import ignore_progress
from driftwalk.core.units import in_percent
from driftwalk.schema.answers.calibration import calibration_answer
from driftwalk.schema.answers.fit import fit_json
from driftwalk.schema.answers.parts import estimates, number_text
from driftwalk.schema.kinds.fit import PARAMETERS
from driftwalk.schema.runs import run_kind
from driftwalk.schema.stores.netcdf import open_netcdf

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study
    from driftwalk.runs import Work


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
FIT, CALIBRATION = "fit", "calibrate"
"""The run directories inside that of the demo, one for each command."""
PAGE = "report.html"
"""The page of both runs, in the same folder."""


def demo(
    out: Path = optional("--out -o DIR", "Directory of both runs.", default=Path("demo")),
    quick: bool = flag("--quick", "Search only a small part; takes seconds, not minutes."),
    threads: Threads = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Fit a bundled recording, check the model, and calibrate on the fitted flow.

    Another engine (ODE) simulated the recording, so the truth is known. First comes the likelihood
    fit of flow, drag, force and tracking noise (DIR/fit), then the paper's map of KS distances in
    the fitted flow (DIR/calibrate). Each is printed next to the truth as soon as it is finished;
    DIR/report.html shows both.
    """
    from driftwalk.datasets import tank30_recording
    from driftwalk.flow import load_flow
    from driftwalk.runs import CalibrationWork, FitWork

    _require_own(out)
    recording, study = tank30_recording(), demo_study(quick=quick)
    tell = ignore_progress if json else print_fit
    fit, flow = out / FIT, out / FIT / "flow.nc"
    folder = files("driftwalk.datasets") / "tank30_ode_a"
    with as_file(folder / "recording.csv") as path:
        inputs = {"recording": path}
        # The fit is printed before it is checked.
        work = FitWork([recording], study, None, inputs, fitted=tell)
        if not _run(work, fit, overwrite=overwrite):
            tell(open_netcdf(fit / run_kind("fit").file))
        stored = open_netcdf(fit / run_kind("fit").file)
        fitted = fit_json(stored, open_netcdf(fit / "check.nc"))
        fitted |= {"flow_error": _flow_error(stored, recording)}
        _write_page(out, FIT)
        if not json:
            off = in_percent(fitted["flow_error"], decimals=1)
            _print_row("flow past the block", "", f"{off} off")
            _print_quality("fit", fitted, floor="ks_noise_floor")
            print_page(out / PAGE)
        field = load_flow(flow, arena=study.tank.to_arena(), own_flags="keep")
        inputs = {**inputs, "flow": flow}
        search = CalibrationWork(recording, study, field, None, inputs, threads)
        _run(search, out / CALIBRATION, overwrite=overwrite)
    calibration = open_netcdf(out / CALIBRATION / run_kind("calibration").file)
    _write_page(out, FIT, CALIBRATION)
    found = calibration_answer(calibration).facts
    if json:
        print_json({"truth": demo_truth(), "fit": fitted, "calibration": found})
        return
    _print_estimates("KS map in the fitted flow", calibration)
    _print_quality("KS map", found, floor="noise_floor")
    print(f"\nfigures: {out}/fit/figures, {out}/calibrate/figures")
    print(f"open in a browser: {out / PAGE}")


def demo_study(*, quick: bool) -> Study:
    """Return the study of the demo: block, tank and force interval are those of the recording."""
    from driftwalk.datasets import tank30_truth
    from driftwalk.model import Study, apply_overrides

    truth = tank30_truth()
    known = {
        "block.side_m": truth["side_m"],
        "block.mass_kg": truth["mass_kg"],
        "forces.force_interval_s": truth["force_interval_s"],
        "tank.diameter_m": 2.0 * truth["tank_radius_m"],
        "tank.wall_friction": truth["wall_friction"],
        "tank.wall_restitution": truth["wall_restitution"],
    }
    return apply_overrides(Study(), {**known, **(QUICK if quick else {})})


def _run(work: Work, folder: Path, *, overwrite: bool) -> bool:
    """Do a piece of work, unless its run is there and finished; return whether it was done."""
    from driftwalk.core.files.run_layout import state_of
    from driftwalk.runs import run_work

    if not overwrite and folder.is_dir() and state_of(folder) == "finished":
        print_note(
            f"{folder} holds a finished run (--overwrite starts a new one); these are its results"
        )
        return False
    with reported(folder.name) as told:
        run_work(work, folder, overwrite=overwrite, **told)
    return True


def _write_page(out: Path, *runs: str) -> None:
    """Write the page of the runs that are there, in place of the one before."""
    from driftwalk.page import joined_page, report_page, write_report

    pages = [report_page(out / run) for run in runs]
    write_report(joined_page(pages, title="Demo"), out / PAGE, existing="replace")


def _require_own(out: Path) -> None:
    """Refuse a directory with anything in it that no demo made, before any work."""
    from driftwalk.core.errors import RunDirectoryError
    from driftwalk.core.files.run_layout import refuse_leading_out, visible
    from driftwalk.core.files.shards import make_folder

    make_folder(out)
    foreign = [entry for entry in visible(out) if entry.name not in (FIT, CALIBRATION, PAGE)]
    if foreign:
        raise RunDirectoryError(
            f"{out} holds files but no run of this demo ({foreign[0].name}, ...); choose an empty "
            "or a new directory"
        )
    refuse_leading_out(out)


ROWS: Final = ("drag_coefficient", "force_std", "tracking_noise")
TRUTH: Final = {
    "drag_coefficient": "acting_drag_coefficient",
    **{name: name for name in ("force_std_N", "force_interval_s", "tracking_noise_m")},
}
"""Keys of the truth that estimates are compared with: of the drag, the one that acts."""


def _flow_error(fit: xr.Dataset, recording: xr.Dataset) -> float:
    """Return the relative error of the fitted flow, averaged over the block; see `score_fit`."""
    from driftwalk.datasets import tank30_flow
    from driftwalk.likelihood import score_fit

    truth = demo_truth()
    score = score_fit(
        fit,
        drag_coefficient=truth["drag_coefficient"],
        force_std=truth["force_std_N"],
        tracking_noise=truth["tracking_noise_m"],
        flow=tank30_flow(),
        recordings=recording,
    )
    return float(score["flow_error"])


def demo_truth() -> dict[str, float]:
    """Return what the estimates are compared with, units in the keys."""
    from driftwalk.datasets import tank30_truth

    truth = tank30_truth()
    return {name: truth[key] for name, key in TRUTH.items()}


def print_fit(fit: xr.Dataset) -> None:
    """Print the estimates of the fit next to the truth, as soon as they are ready."""
    from driftwalk.datasets import tank30_truth

    truth = tank30_truth()
    print("This recording was simulated by another engine (ODE): the truth is known.")
    _print_estimates("likelihood fit", fit)
    every, step = (1e3 * truth[name] for name in ("force_interval_s", "time_step_s"))
    was, acts = (truth[name] for name in ("drag_coefficient", "acting_drag_coefficient"))
    # Through a pipe the answer would wait in the buffer for the check and the map.
    print(
        f"Intervals of 90 %; σ_F redrawn every {every:g} ms. The engine's C_d was set to {was:g}; "
        f"in its steps\nof {step:g} ms the drag acts like {acts:g}.",
        flush=True,
    )


def print_page(page: Path) -> None:
    """Say what comes next: the page of the fit can be opened meanwhile."""
    print(f"Its page: {page}")
    # How long it takes stands at the bar below, which measures it.
    print("Next, the paper's method: a map of KS distances in the fitted flow.\n", flush=True)


def _print_estimates(method: str, found: xr.Dataset) -> None:
    truth = demo_truth()
    _print_row("", "truth", method)
    shown = {one.number.name: one for one in estimates(found)}
    for name in ROWS:
        number, text = PARAMETERS[name], "taken from the recording"
        if name in shown:
            value, *ends = (
                number_text(number.factor * one)
                for one in (shown[name].value, *(shown[name].ends or ()))
            )
            text = f"{value} ({' to '.join(ends)})" if ends else value
        label = f"{number.words} ({number.reader_unit})" if number.reader_unit else number.words
        _print_row(label, f"{number.factor * truth[number.key]:.4g}", text)


def _print_row(name: str, truth: str, found: str) -> None:
    print(f"{name:27}{truth:9}{found}".rstrip())


def _print_quality(name: str, facts: dict[str, Any], *, floor: str) -> None:
    """Print how far off simulations are, the verdict on the model, and what warns."""
    _print_row("KS distance, floor", "", f"{facts['ks_distance']:.3f}, {facts[floor]:.3f}")
    _print_row("verdict", "", facts["verdict"])
    for reason in facts["verdict_reasons"]:
        print_note(f"{facts['verdict']}: {reason}")
    for warning in facts["warnings"]:
        print_note(f"warning: {name}: {warning}")
