"""Held-out test of the kinetics: 2000 runs to fit, four sets of 2000 to test, in twelve settings.

    python studies/kinetics/run.py results.json        (some 10 minutes)

Each setting is (factor on the bundled flow, sigma_F in mN), C_d 0.45, 4 blocks, 300 s, latching by
collision, hidden faces free. For each candidate model: l1 distance of the predicted shares to those
of the first test set at 60, 120 and 300 s, and the KS distance of the completion times. The chosen
model is compared with all four sets, and also when fitted to the 8000 runs of the other sets.
"""

from __future__ import annotations

import json
import sys
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import driftwalk as dw
from driftwalk.assembly.chains.hidden import FORMS, GRID_STEPS, fit, shares
from driftwalk.assembly.chains.histories import histories
from driftwalk.assembly.chains.transition_rates import empirical_shares

SETTINGS = tuple(product((0.0, 0.5, 1.0, 1.5), (0.2, 0.55, 1.2)))
TIMES = np.array([60.0, 120.0, 300.0])
RUNS, DURATION = 2000, 300.0
AT = np.rint(TIMES / DURATION * GRID_STEPS).astype(int)
HELD_OUT = (2, 3, 4, 5)


def runs_of(scale: float, force: float, seed: int) -> xr.Dataset:
    """Return the runs of a setting."""
    flow = dw.tank30_flow().copy()
    for name in ("u", "v"):
        flow[name] = scale * flow[name]
    return dw.assemble(
        dw.Study(), flow, blocks=4, runs=RUNS, duration=DURATION, drag_coefficient=0.45,
        force_std=1e-3 * force, latching="collision", hidden_face_drag="none", seed=seed,
    )  # fmt: skip


def row_of(scale: float, force: float) -> dict[str, Any]:
    """Return what each model reaches in a setting, and which one is chosen."""
    runs = [runs_of(scale, force, seed) for seed in (1, *HELD_OUT)]
    chosen = dw.kinetics(runs[0])
    names = [str(name) for name in runs[0]["class"].values]
    fitted = histories(runs[:1], classes=names)
    seen = [empirical_shares(histories([one], classes=names), TIMES) for one in runs]
    whole = np.array(["+" not in name for name in names])
    done = np.sort(runs[1]["completion_time"].values)
    models, curves = {}, {}
    for form in FORMS:
        time, course = shares(fit(fitted, form), DURATION)
        curves[form] = course[AT]
        completed = np.searchsorted(done, time, side="right") / RUNS
        models[form.name] = {
            "l1": distance(course[AT], seen[1]),
            "ks": round(float(np.abs(course[:, whole].sum(axis=1) - completed).max()), 3),
        }
    [form] = [one for one in FORMS if one.name == chosen.attrs["chosen"]]
    held_out = {}
    for k, seed in enumerate(HELD_OUT, start=1):
        others = histories(runs[:k] + runs[k + 1 :], classes=names)
        held_out[str(seed)] = {
            "l1": distance(curves[form], seen[k]),
            "l1_fitted_to_8000": distance(shares(fit(others, form), DURATION)[1][AT], seen[k]),
            "l1_of_the_two_sets": distance(seen[0], seen[k]),
            "l1_floor_95": floors_of(seen[k], RUNS),
        }
    return {
        "flow_scale": scale,
        "force_std_mN": force,
        "verdict": chosen.attrs["verdict"],
        "chosen": chosen.attrs["chosen"],
        "reasons": chosen["reason"].values.tolist(),
        "held_out": held_out,
        "l1_floor_95_model_exact": floors_of(seen[1], None),
        "ks_floor_95": round(1.358 / RUNS**0.5, 3),
        "score_behind": chosen["score_behind"].values.round(4).tolist(),
        "models": models,
    }


def distance(one: np.ndarray, other: np.ndarray) -> list[float]:
    """Return the l1 distance of shares at each time."""
    return np.abs(one - other).sum(axis=1).round(3).tolist()


def floors_of(law: np.ndarray, other: int | None) -> list[float]:
    """Return the floor of l1 at each time, for as many other runs or an exact law."""
    return [round(dw.l1_noise_floor(row, RUNS, other).quantile, 3) for row in law]


def first_joins() -> list[dict[str, Any]]:
    """Return the rate of the first joining per pair for several numbers of blocks."""
    rows = []
    for scale, blocks in product((0.0, 1.0), (2, 3, 4, 6, 8)):
        flow = dw.tank30_flow().copy()
        for name in ("u", "v"):
            flow[name] = scale * flow[name]
        found = dw.assemble(
            dw.Study(), flow, blocks=blocks, runs=1000, duration=DURATION, drag_coefficient=0.45,
            force_std=5.5e-4, latching="collision", hidden_face_drag="none", seed=3,
        )  # fmt: skip
        first = found["event_time"].values[:, 0]
        rate = np.isfinite(first).sum() / np.nan_to_num(first, nan=DURATION).sum()
        rows.append({
            "flow_scale": scale, "blocks": blocks,
            "rate_per_pair_per_s": float(rate / (blocks * (blocks - 1) / 2)),
        })  # fmt: skip
    return rows


def main(place: Path) -> None:
    """Write the table, one setting after the other."""
    rows: list[dict[str, Any]] = []
    for scale, force in SETTINGS:
        rows.append(row_of(scale, force))
        found = rows[-1]["models"][rows[-1]["chosen"]]
        print(scale, force, rows[-1]["chosen"], found, rows[-1]["verdict"], flush=True)
        place.write_text(json.dumps({"settings": rows}, indent=1) + "\n", encoding="utf-8")
    whole = {"settings": rows, "first_joins": first_joins()}
    place.write_text(json.dumps(whole, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
