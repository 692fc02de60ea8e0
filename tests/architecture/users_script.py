"""A script of a user, for `make lint`: mypy accepts what is right and finds what is wrong in it.

It is checked, never run. Each mistake carries what mypy has to say of it: where mypy says nothing,
the comment is unused, which is an error under `strict`.
"""

from typing import assert_type

import xarray as xr

import driftwalk as dw


def right() -> None:
    """Hold no mistake."""
    recording = dw.load("track.csv", tank="circle:30cm")
    flow = dw.uniform_flow(0.0, 0.01)
    study = dw.apply_overrides(dw.Study(), {"forces.force_interval_s": "16ms"})
    run = dw.simulate(study, flow, replicates=8)
    distance: float = float(dw.compare(recording, run.isel(replicate=0))["ks_distance"])
    fit = assert_type(dw.fit_motion(recording, study), xr.Dataset)
    found = dw.calibrate(recording, study, flow=dw.fitted_flow(fit))
    tracker = dw.track.Tracker(dw.track.TrackerSettings(max_speed=0.5, bodies=4))
    try:
        dw.describe(recording)
    except dw.InputError as error:
        print(error.args, distance, found, tracker)


def wrong(recording: xr.Dataset, study: dw.Study, flow: xr.Dataset) -> None:
    """Hold a mistake in every line."""
    dw.simulate(study, flow, replicates="eight")  # type: ignore[arg-type]
    dw.simulate(study, flow, replicats=8)  # type: ignore[call-arg]
    dw.load("track.csv", tank_diameter=0.3)  # type: ignore[call-arg]
    dw.calibrate(recording, study, threads=2.5)  # type: ignore[arg-type]
    dw.simulatte(study, flow)  # type: ignore[attr-defined]
    dw.compare(recording)  # type: ignore[call-arg]
