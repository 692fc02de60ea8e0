"""`driftwalk fit`: flow, drag, stochastic force and tracking noise from recordings, in seconds."""

from __future__ import annotations

from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from driftwalk.cli.inputs.require_motion import require_motion
from driftwalk.cli.inputs.study_recording import default_tank_note, load_for_run
from driftwalk.cli.options.recording import RecordingOptions, with_recording_options
from driftwalk.cli.options.shared import (
    PANEL,
    Depth,
    ForceInterval,
    Json,
    Mass,
    Side,
    StudyFile,
    TankDiameter,
    quantity_option,
    resolve_study,
)
from driftwalk.cli.terminal.output import print_json, print_note, report_command
from driftwalk.cli.terminal.progress import reported
from driftwalk.core.study_keys import FIT_KEYS, study_overrides
from driftwalk.schema.facts import fit_facts, sentences

if TYPE_CHECKING:
    import xarray as xr

MOST_FINDINGS: Final = 2
"""Findings that are printed; all are in the file."""
FAR_ABOVE_FLOOR: Final = 2.0
SMALLEST_FIXED: Final = 1e-3
"""Smaller numbers are printed with an exponent."""
RecordingFiles = Annotated[
    list[Path],
    typer.Argument(
        metavar="RECORDING...",
        help="Recordings of one block in one tank, read with the same options.",
    ),
]


@with_recording_options
def fit(
    recordings: RecordingFiles,
    how: RecordingOptions,
    out: Annotated[Path, typer.Option("--out", "-o", metavar="DIR", help="Run directory to make.")],
    study: StudyFile = None,
    tank_diameter: TankDiameter = None,
    side: Side = None,
    mass: Mass = None,
    depth: Depth = None,
    force_interval: ForceInterval = None,
    angle: Annotated[
        str | None,
        typer.Option(
            "--angle",
            metavar="auto|state|given|none",
            help="Use of the recorded orientation (default: auto).",
            rich_help_panel=PANEL,
            show_default=False,
        ),
    ] = None,
    spline_spacing: Annotated[
        Any,
        quantity_option("--spline-spacing", "m", "Distance between the knots of the flow.", "auto"),
    ] = None,
    confidence: Annotated[
        float | None, quantity_option("--confidence", "1", "Confidence of the intervals.")
    ] = None,
    switching_times: Annotated[
        str | None,
        typer.Option(
            "--switching-times",
            metavar="<s,s,...>",
            help="Times at which the pumps were switched, on each recording's clock; "
            "each interval has its own flow.",
            rich_help_panel=PANEL,
            show_default=False,
        ),
    ] = None,
    flow_labels: Annotated[
        str | None,
        typer.Option(
            "--flow-labels",
            metavar="A,B,...",
            help="Names of the flows between switching times; repeat a name for a "
            "flow that comes back.",
            rich_help_panel=PANEL,
            show_default=False,
        ),
    ] = None,
    precision: Annotated[
        float | None,
        quantity_option(
            "--precision", "1", "Wanted relative standard error of C_d (default: 0.1)."
        ),
    ] = None,
    no_check: Annotated[
        bool,
        typer.Option("--no-check", help="Skip the check whether the model explains the recording."),
    ] = False,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Move a finished run aside and start a new one.")
    ] = False,
    json: Json = False,
) -> None:
    """Fit flow, drag, stochastic force and tracking noise to recordings, together.

    A filter predicts each position from the earlier ones; the fit chooses the parameters that make
    its errors most likely. Gaps and uneven sampling are handled. The run directory holds the fit
    (fit.nc), the flow (flow.nc) for every command that takes one, the recording, the check of the
    model (check.nc), figures and manifest.json.
    """
    from driftwalk.conditions import require_inside, study_in_arena
    from driftwalk.runs import FitWork, run_fit

    overrides = study_overrides(
        keys=FIT_KEYS,
        tank_diameter=tank_diameter,
        side=side,
        mass=mass,
        depth=depth,
        force_interval=force_interval,
        angle=angle,
        spline_spacing=spline_spacing,
        confidence=confidence,
        switching_times=_items(switching_times),
        flow_labels=_items(flow_labels),
        precision=precision,
    )
    chosen = resolve_study(study, overrides, keys=FIT_KEYS)
    unsaid = study is None and tank_diameter is None and how.arena is None
    loaded = []
    for path in recordings:
        loaded.append(load_for_run(path, chosen, how, tank="unsaid" if unsaid else "stated"))
        require_motion(loaded[-1].trajectory, path, body=how.body)
    trajectories = [one.trajectory for one in loaded]
    chosen = study_in_arena(chosen, trajectories[0])
    for one in trajectories:
        require_inside(chosen, one, how.body)
    remark = None if loaded[0].has_tank else default_tank_note(chosen)
    inputs = {"recording" if n == 0 else f"recording-{n + 1}": p for n, p in enumerate(recordings)}
    inputs.update({"study": study} if study is not None else {})
    work = FitWork(trajectories, chosen, how.body, inputs, check=not no_check)
    with reported("fit") as told:
        found = run_fit(work, out, overwrite=overwrite, begun=remark, **told)
    if json:
        print_json(answer(found.fit, found.check))
    else:
        print_answer(found.fit, out)
        print_verdict(found.check, found.fit)
        print(f"all in one page        {report_command(out)}")


def _items(text: str | None) -> list[str] | None:
    """Return what stands between the commas; what it means the study says."""
    return None if text is None else [item.strip() for item in text.split(",")]


_KEYS = (
    "drag_coefficient",
    "drag_coefficient_interval",
    "force_std_N",
    "force_std_N_interval",
    "force_interval_s",
    "force_noise_intensity_N2_s",
    "force_noise_intensity_N2_s_interval",
    "tracking_noise_m",
    "tracking_noise_m_interval",
    "confidence",
    "maximum_likelihood_drag_coefficient",
    "wetted_depth_m",
    "wall_share",
    "angle",
    "chi_squared_per_dof",
    "autocorrelation",
    "autocorrelation_std",
    "samples",
    "samples_used",
    "duration_s",
    "recordings",
    "iterations",
    "converged",
    "visited_share",
    "drag_coefficient_relative_std",
    "drag_coefficient_precision",
    "needed_duration_s",
    "switching_times_s",
)
"""The last ones where they are in the fit."""


def summary(found: xr.Dataset) -> dict[str, Any]:
    """Return the fit with units in its keys."""
    facts = fit_facts(found)
    return {
        **{key: facts[key] for key in _KEYS if key in facts},
        "recording": facts["source"],
        "warnings": facts["warnings"],
    }


def answer(fit: xr.Dataset, check: xr.Dataset | None) -> dict[str, Any]:
    """Return all that ``--json`` prints: the fit, and the check where one was asked for."""
    return summary(fit) | verdict(check, fit)


def print_answer(found: xr.Dataset, folder: Path) -> None:
    """Print the answer for people, and where the flow is."""
    facts = fit_facts(found)
    if facts["simulated_recording"] == "yes":
        print("This recording was simulated by another engine (ODE).")
    every = f", redrawn every {1e3 * facts['force_interval_s']:g} ms"
    rows = (
        ("drag coefficient C_d   ", "drag_coefficient", 1.0, "", ""),
        ("stochastic force σ_F   ", "force_std_N", 1e3, " mN", every),
        ("tracking noise         ", "tracking_noise_m", 1e3, " mm", ""),
    )
    for name, key, scale, unit, more in rows:
        low, high = (scale * end for end in facts[f"{key}_interval"])
        value, low, high = (_number(one) for one in (scale * facts[key], low, high))
        print(f"{name}{value}{unit}{more}   {facts['confidence']:.0%} interval {low} to {high}")
    print(f"noise intensity σ_F²·τ {facts['force_noise_intensity_N2_s']:.4g} N² s")
    print(f"intervals at the wall  {facts['wall_share']:.1%}, left out")
    if "flow" in found.dims:
        names = found["flow"].values[found["interval_flow"].values]
        times = ", ".join(f"{time:g} s" for time in facts["switching_times_s"])
        print(f"flows                  {', '.join(names)}, switched at {times}")
    for warning in facts["warnings"]:
        print_note(f"warning: {warning}")
    print(f"flow                   {folder / 'flow.nc'}")


def _number(value: float) -> str:
    """Return a number with four decimals, or with three digits where these would all be zeros."""
    return f"{value:.4f}" if value >= SMALLEST_FIXED else f"{value:.3g}"


def verdict(check: xr.Dataset | None, fit: xr.Dataset) -> dict[str, Any]:
    """Return the check of the model with units in its keys; nothing where none was asked for."""
    if check is None:
        reason = fit.attrs.get("check_left_out")
        return {} if reason is None else {"explained": None, "check_left_out": reason}
    facts = check.attrs
    distances = {key: float(facts[key]) for key in ("ks_distance", "ks_noise_floor")}
    return {
        "explained": bool(check["explained"]),
        "findings": sentences(check, "finding"),
        **{key: value if isfinite(value) else None for key, value in distances.items()},
    }


def print_verdict(check: xr.Dataset | None, fit: xr.Dataset) -> None:
    """Print whether the model explains the recording, and the worst of what speaks against it."""
    found = verdict(check, fit)
    if check is None:
        if found:
            print(f"model check            {found['check_left_out']}")
        return
    if found["explained"]:
        print("model check            the model explains this recording")
    else:
        print("model check            THE MODEL DOES NOT EXPLAIN THIS RECORDING:")
        for finding in found["findings"][:MOST_FINDINGS]:
            print(f"  {finding}")
        more = len(found["findings"]) - MOST_FINDINGS
        if more > 0:
            print(f"  and {more} more: see findings in check.nc, or --json")
    if found["ks_distance"] is None:
        print(f"KS distance            not available: {check.attrs['ks_left_out']}")
    else:
        far = found["ks_distance"] > FAR_ABOVE_FLOOR * found["ks_noise_floor"]
        print(
            f"KS distance            {found['ks_distance']:.3f}, "
            f"noise floor {found['ks_noise_floor']:.3f}"
            + (": far, but within the uncertainty of the fit" if found["explained"] and far else "")
        )
