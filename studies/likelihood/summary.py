"""The tables of a study, and its results with their manifest where they are to be stored.

    python studies/likelihood/summary.py OUT [--store FOLDER]

Reads what run.py wrote into OUT and prints a table for each set and estimator; `--store` writes
them as `tables.md` and `tables.json` beside copies of the results and a manifest.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from lines import read_lines
from study_sets import FIRST_SEED

import driftwalk as dw
from driftwalk.core.files.atomic import write_atomic
from driftwalk.core.provenance import manifest, write_manifest

MOST_WALL_SHARE = 0.3
"""Recordings above it are counted and left out: there the fit itself says not to believe it."""
PARAMETERS = {
    "drag_coefficient": ("C_d", (0.10, 0.15)),
    "force_std_N": ("σ_F", (0.03,)),
    "flow_error": ("flow, block", (0.06, 0.08)),
    "flow_point_error": ("flow, point", ()),
}
"""What has an error, what it is called, and the errors within which it is counted."""
WITH_INTERVAL = ("drag_coefficient", "force_std_N", "tracking_noise_m")
HEAD = (
    "recordings", "median", "90 %", "largest", "mean", "within", "rms z", "in 90 % interval",
)  # fmt: skip


def main() -> None:
    """Print the tables, and store them when asked to."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--store", type=Path, default=None)
    options = parser.parse_args()
    sources = sorted(options.out.glob("*.jsonl"))
    tables = {source.stem: tables_of(read_lines(source)) for source in sources}
    text = "\n".join(markdown(name, found) for name, found in tables.items())
    print(text)
    versions = {line["estimator"] for source in sources for line in read_lines(source)}
    if len(versions) > 1:
        print(f"These are results of {len(versions)} versions of the estimator.", file=sys.stderr)
    if options.store is not None:
        store(options.store, sources, text, tables)


def tables_of(lines: list[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Return the figures of each condition, and of each family where there is one condition."""
    conditions = list(dict.fromkeys(line["condition"] for line in lines))
    groups = {one: [line for line in lines if line["condition"] == one] for one in conditions}
    if len(conditions) == 1:
        families = sorted({line["family"] for line in lines})
        groups = {"all": lines} | {
            one: [line for line in lines if line["family"] == one] for one in families
        }
    return {name: figures_of(group) for name, group in groups.items()}


def figures_of(lines: list[dict[str, Any]]) -> dict[str, Any]:
    """Return how far the fits of some recordings are from the truth."""
    fitted = [line for line in lines if "error" not in line]
    away = [line for line in fitted if line["wall_share"] < MOST_WALL_SHARE]
    found: dict[str, Any] = {
        "recordings": len(away),
        "failed": len(lines) - len(fitted),
        "at_the_wall": len(fitted) - len(away),
    }
    if not away:
        return found
    for name, (_, bars) in PARAMETERS.items():
        flow = name.startswith("flow")
        error = values_of(away, name if flow else f"{name}_error")
        known = error[np.isfinite(error)]
        within = {f"{bar:g}": share(error, bar) for bar in bars}
        found[name] = {**spread(known), "within": within} if known.size else {}
    for name in WITH_INTERVAL:
        z, covered = values_of(away, f"{name}_z"), values_of(away, f"{name}_covered")
        found.setdefault(name, {}).update(
            rms_z=float(np.sqrt(np.mean(z**2))),
            mean_z=float(z.mean()),
            covered=float(covered.mean()),
        )
    for name in ("wall_share", "seconds"):
        value = values_of(away, name)
        found[name] = {"median": float(np.median(value)), "largest": float(value.max())}
    return found


def values_of(lines: list[dict[str, Any]], name: str) -> npt.NDArray[np.float64]:
    """Return one number of every line."""
    return np.array([float(line[name]) for line in lines])


def spread(error: npt.NDArray[np.float64]) -> dict[str, float]:
    """Return median, 90 % point and largest size of an error, and its mean with the sign."""
    size = np.abs(error)
    return {
        "median": float(np.median(size)),
        "ninety": float(np.quantile(size, 0.9)),
        "largest": float(size.max()),
        "mean": float(error.mean()),
    }


def share(error: npt.NDArray[np.float64], bar: float) -> float:
    """Return the share of errors within a bar; one that is not a number is not."""
    return float(np.mean(np.abs(error) <= bar))


def markdown(name: str, tables: dict[str, dict[str, Any]]) -> str:
    """Return the table of a set as Markdown."""
    rows = [f"## {name}", "", "| | | " + " | ".join(HEAD) + " |", "|" + "---|" * (len(HEAD) + 2)]
    notes = []
    for group, found in tables.items():
        for parameter, (label, _) in PARAMETERS.items():
            if found.get(parameter):
                rows.append(row(group, label, found["recordings"], found[parameter]))
        notes.append(note(group, found))
    return "\n".join([*rows, "", *notes, ""])


def row(group: str, label: str, count: int, found: dict[str, Any]) -> str:
    """Return a row of the table."""
    within = ", ".join(f"{part:.0%} in {float(bar):.0%}" for bar, part in found["within"].items())
    cells = [group, label, str(count)]
    cells += [f"{found[key]:.1%}" for key in ("median", "ninety", "largest")]
    cells += [f"{found['mean']:+.1%}", within]
    cells += [f"{found['rms_z']:.2f}", f"{found['covered']:.0%}"] if "rms_z" in found else ["", ""]
    return "| " + " | ".join(cells) + " |"


def note(group: str, found: dict[str, Any]) -> str:
    """Return what is not in the rows: what was left out, wall and time."""
    words = (
        f"- {group}: {found['at_the_wall']} left out for the wall, {found['failed']} without answer"
    )
    if "seconds" not in found:
        return words
    wall, seconds, noise = found["wall_share"], found["seconds"], found["tracking_noise_m"]
    return words + (
        f"; wall share {wall['median']:.0%} (largest {wall['largest']:.0%}); tracking noise rms z "
        f"{noise['rms_z']:.2f}, in its interval {noise['covered']:.0%}; seconds of a fit "
        f"{seconds['median']:.1f} (largest {seconds['largest']:.1f})"
    )


def store(folder: Path, sources: list[Path], text: str, tables: dict[str, Any]) -> None:
    """Write tables, results in the order of their recordings, and the manifest."""
    folder.mkdir(parents=True, exist_ok=True)
    write_atomic(folder / "tables.md", f"{text}\n".encode())
    write_atomic(folder / "tables.json", (json.dumps(tables, indent=1) + "\n").encode())
    stored = {}
    for source in sources:
        lines = sorted(read_lines(source), key=lambda line: (line["number"], line["condition"]))
        stored[source.stem] = folder / source.name
        words = "".join(json.dumps(line) + "\n" for line in lines)
        write_atomic(stored[source.stem], words.encode())
    facts = manifest(
        command=["python", *sys.argv],
        study=dw.Study().to_dict(),
        seeds=FIRST_SEED,
        inputs=stored,
    )
    write_manifest(folder / "manifest.json", facts)


if __name__ == "__main__":
    main()
