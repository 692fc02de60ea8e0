"""Output of `driftwalk compare-models`: a table for people, the same as JSON for programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.cli.terminal.answer import print_report_next, print_row, print_warnings
from driftwalk.cli.terminal.output import print_table
from driftwalk.cli.terminal.progress import ProgressReporter
from driftwalk.schema.answers.model_words import ASPECT_WORDS

if TYPE_CHECKING:
    import xarray as xr

COLUMNS = ("model", "numbers", "distance", "behind", "D of steps", "explained")
SUMMARIES = ("misfit", "usual_misfit", "most_misfit", "unlikely")


def summary(found: xr.Dataset) -> dict[str, Any]:
    """Return what ``--json`` prints: the models from the closest on, and the recording itself."""
    aspects = [str(name) for name in found["aspect"].values]
    checks = [str(name) for name in found["check"].values]
    return {
        "findings": [str(text) for text in found["finding"].values],
        "models": [_model(one, aspects, checks) for one in _each(found)],
        "own_distance": dict(zip(aspects, found["own_distance"].values.tolist(), strict=True)),
        "floor": dict(zip(aspects, found["floor"].values.tolist(), strict=True)),
        "checks": {
            name: {"unit": str(unit), "recorded": float(value)}
            for name, unit, value in zip(
                checks, found["check_unit"].values, found["check_recorded"].values, strict=True
            )
        },
        **{key: found.attrs[key] for key in ("step_interval_s", "duration_s", "worlds", "seed")},
        **{
            key: found.attrs[key]
            for key in ("halves_ks_distance", "halves_p_value")
            if key in found.attrs
        },
        "warnings": [str(text) for text in found["warning"].values],
    }


def _model(one: xr.Dataset, aspects: list[str], checks: list[str]) -> dict[str, Any]:
    known = np.isfinite(one["estimate"].values)
    ends = one["end_score"].values
    return {
        "model": str(one["model"].values),
        "explained": bool(one["explained"]),
        "verdict": str(one["verdict"].values),
        "baseline": bool(one["baseline"]),
        "numbers": int(one["free_numbers"]),
        "score": float(one["score"]),
        "score_std": float(one["score_std"]),
        "behind": float(one["behind"]),
        "behind_std": float(one["behind_std"]),
        **_summaries(one),
        "held_out_distance": dict(
            zip(aspects, one["held_out_distance"].values.tolist(), strict=True)
        ),
        "checks": {
            name: [float(one[f"check_{part}"][k]) for part in ("low", "median", "high")]
            for k, name in enumerate(checks)
        },
        "estimate": {
            str(name): {"value": float(value), "unit": str(unit)}
            for name, value, unit in zip(
                one["parameter"].values[known],
                one["estimate"].values[known],
                one["parameter_unit"].values[known],
                strict=True,
            )
        },
        "end_scores": ends[np.isfinite(ends)].tolist(),
        "evaluations": int(one["evaluations"]),
    }


def _summaries(one: xr.Dataset) -> dict[str, Any]:
    """Return what the summaries of the motion say, of a model that was asked."""
    if "asked" not in one or not bool(one["asked"]):
        return {}
    return {"named": bool(one["named"]), **{name: float(one[name]) for name in SUMMARIES}}


class Ranking:
    """Prints each model as soon as it is judged, its place so far, and how long the rest takes.

    Parameters
    ----------
    progress : ProgressReporter
        Knows the time left.
    """

    def __init__(self, progress: ProgressReporter) -> None:
        self._progress = progress
        self._scores: list[float] = []

    def __call__(self, name: str, score: float, std: float, models: int) -> None:
        """Print a model."""
        place = 1 + sum(one < score for one in self._scores)
        self._scores.append(score)
        count = len(self._scores)
        words = f"{name}: distance {score:.2f} ± {std:.2f}, place {place} of {count} so far"
        rest = f"; {models - count} to go" if models > count else ""
        left = f"; {self._progress.left}" if self._progress.left else ""
        print(f"{words}{rest}{left}", flush=True)


def print_answer(found: xr.Dataset, folder: Path) -> None:
    """Print the answer, the ranking, what the answer follows from, and where everything is."""
    rows = [
        (
            str(one["model"].values),
            int(one["free_numbers"]),
            f"{float(one['score']):.2f} ± {float(one['score_std']):.2f}",
            _behind(one, index),
            f"{float(one['held_out_distance'][0]):.3f}",
            *((_misfit(one),) if "asked" in found else ()),
            _explained(one),
        )
        for index, one in enumerate(_each(found))
    ]
    columns = (*COLUMNS[:-1], *(("misfit",) if "asked" in found else ()), COLUMNS[-1])
    answer, *why = map(str, found["finding"].values)
    print(f"{answer}.")
    print_table(rows, columns=columns, title="models, the closest first")
    own = ", ".join(
        f"{ASPECT_WORDS.get(str(name), name)} {float(value):.3f}"
        for name, value in zip(found["aspect"].values, found["own_distance"].values, strict=True)
    )
    print(f"D of the recording's own parts: {own}")
    for text in why:
        print(f"{text}.")
    print_warnings(str(text) for text in found["warning"].values)
    print_row("comparison", folder / "comparison.nc")
    print_row("figures", folder / "figures")
    print_report_next(folder)


def _behind(one: xr.Dataset, index: int) -> str:
    return "" if not index else f"{float(one['behind']):.2f} ± {float(one['behind_std']):.2f}"


def _misfit(one: xr.Dataset) -> str:
    if not bool(one["asked"]):
        return ""
    return f"{float(one['misfit']):.0f} (own below {float(one['most_misfit']):.0f})"


def _explained(one: xr.Dataset) -> str:
    if bool(one["baseline"]):
        return "a walk of steps"
    return "yes" if bool(one["explained"]) else "no"


def _each(found: xr.Dataset) -> list[xr.Dataset]:
    return [found.isel(model=index) for index in range(found.sizes["model"])]
