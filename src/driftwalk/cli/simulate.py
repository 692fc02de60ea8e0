"""`driftwalk simulate`: trajectories of a block in a stirred tank."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from driftwalk.cli.options.recording import RecordingOptions
from driftwalk.cli.options.shared import Json
from driftwalk.cli.options.study import StudyOptions, with_study_options
from driftwalk.cli.terminal.output import print_json, print_note, require_place
from driftwalk.core.errors import InputError
from driftwalk.core.study_keys import STUDY_KEYS

if TYPE_CHECKING:
    import xarray as xr


@with_study_options(
    STUDY_KEYS,
    *("tank_diameter", "side", "mass", "depth", "drag_coefficient", "force_std", "force_interval"),
    *("wall_friction", "wall_restitution", "time_step", "duration", "sample_rate"),
    *("position_noise", "orientation_noise", "replicates", "seed"),
)
def simulate(
    flow: Annotated[
        Path,
        typer.Option("--flow", metavar="FILE", help="Flow field: NetCDF, or CSV with x, y, u, v."),
    ],
    out: Annotated[Path, typer.Option("--out", "-o", metavar="FILE.nc", help="File to write.")],
    given: StudyOptions,
    like: Annotated[
        Path | None,
        typer.Option(
            "--like",
            metavar="RECORDING",
            help="Recording that gives start, time stamps and gaps (driftwalk's "
            "NetCDF or plain CSV).",
            show_default=False,
        ),
    ] = None,
    body: Annotated[
        str | None,
        typer.Option("--body", metavar="NAME", help="Body of --like.", show_default=False),
    ] = None,
    backend: Annotated[
        str,
        typer.Option(
            "--backend",
            metavar="cpu|reference",
            help="Backend: cpu for single, reference for double precision.",
        ),
    ] = "cpu",
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace a file that exists.")
    ] = False,
    json: Json = False,
) -> None:
    """Simulate the motion of the block."""
    from driftwalk.conditions import simulate_like, study_for
    from driftwalk.core.atomic import write_atomic
    from driftwalk.flow import load_flow
    from driftwalk.schema.netcdf import netcdf_bytes
    from driftwalk.simulation import simulate as run

    if backend not in ("cpu", "reference"):
        raise InputError(f"--backend takes cpu or reference, got '{backend}'")
    if like is not None and backend == "reference":
        raise InputError("--like runs on the cpu backend only: leave out --backend")
    require_place(out, existing="replace" if overwrite else "error")
    chosen = given.study()
    field = load_flow(flow)
    if like is None:
        result = run(chosen, field, backend="reference" if backend == "reference" else "cpu")
    else:
        recording = RecordingOptions(body=body).load(like)
        result = simulate_like(study_for([recording], chosen, body=body), field, recording)
    write_atomic(out, netcdf_bytes(result))
    facts = summary(result)
    if json:
        print_json({"file": str(out), **facts})
        return
    print_note(
        f"wrote {out}: {facts['replicates']} x {facts['samples']} samples over "
        f"{facts['duration_s']:g} s; σ_F = {1e3 * facts['force_std_N']:g} mN redrawn every "
        f"{1e3 * facts['force_interval_s']:g} ms"
    )
    for name, count in facts["status"].items():
        if count:
            print_note(f"warning: {count} of {facts['replicates']} replicates: {name}")


def summary(result: xr.Dataset) -> dict[str, Any]:
    """Return what a simulation is in a few numbers, units in the keys."""
    status = result["status"]
    masks = status.attrs["flag_masks"]
    names = status.attrs["flag_meanings"].split()
    path = np.hypot(*(np.diff(result[name].values, axis=1) for name in ("x", "y")))
    elapsed = float(result["time"].values[-1] - result["time"].values[0])
    return {
        "replicates": int(result.sizes["replicate"]),
        "samples": int(result.sizes["time"]),
        "duration_s": elapsed,
        "drag_coefficient": result.attrs["drag_coefficient"],
        "force_std_N": result.attrs["force_std_N"],
        "force_interval_s": result.attrs["force_interval_s"],
        "force_noise_intensity_N2_s": result.attrs["force_noise_intensity_N2_s"],
        "time_step_s": result.attrs["time_step_s"],
        "seed": result.attrs["seed"],
        "mean_speed_m_s": float(np.nansum(path) / (elapsed * path.shape[0])) if elapsed else 0.0,
        "status": {
            name: int(((status.values & mask) != 0).sum())
            for name, mask in zip(names, masks, strict=True)
        },
    }
