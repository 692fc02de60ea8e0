"""The tables of the study, and its results with their manifest where they are to be stored.

    python studies/tracking/summary.py OUT [--store FOLDER]

Reads what run.py wrote into OUT, of each video the last line, and prints a table for each set, bars
and what was measured beside them first; `--store` writes `tables.md`, `tables.json` and
`results.csv` beside the results and a manifest.
"""

from __future__ import annotations

import argparse
import csv
import io
import json
import sys
from pathlib import Path
from typing import Any, Final

import numpy as np
from run import read_lines
from scenes import SEEDS

import driftwalk as dw
from driftwalk.core.files.atomic import write_atomic
from driftwalk.core.provenance import manifest, write_manifest

Line = dict[str, Any]
SYNTHETIC: Final = ("moderate", "heavy", "closed-loop")
SUMMED: Final = (
    "samples", "samples_visible", "lost", "lost_visible", "false", "swaps", "unmarked",
    "unmarked_at_sample",
)  # fmt: skip
WORST: Final = ("position_worst_mm", "angle_worst_deg")
POOLED: Final = ("position_rms_mm", "angle_rms_deg", "z_x", "z_y", "z_theta", "z_total")
MEANS: Final = ("x_bias_mm", "y_bias_mm", "angle_bias_deg", "ambiguous_share", "frames_per_s")
COLUMNS: Final = {
    "seed": ("key", "{}"),
    "blocks": ("latching", "{}"),
    "position rms, worst [mm]": (("position_rms_mm", "position_worst_mm"), "{:.3f}, {:.2f}"),
    "bias x, y [mm]": (("x_bias_mm", "y_bias_mm"), "{:+.3f}, {:+.3f}"),
    "angle rms, worst [°]": (("angle_rms_deg", "angle_worst_deg"), "{:.2f}, {:.1f}"),
    "recall, visible": ("recall_visible", "{:.2%}"),
    "recall, all": ("recall", "{:.2%}"),
    "false": ("false", "{}"),
    "swaps, unmarked": (("swaps", "unmarked"), "{}, {}"),
    "marked ambiguous": ("ambiguous_share", "{:.1%}"),
    "z x, y, θ": (("z_x", "z_y", "z_theta"), "{:.2f}, {:.2f}, {:.2f}"),
}
LATCHING: Final = {"none": "never join", "collision": "join", "all": ""}


def main() -> None:
    """Print the tables, and store them when asked to."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--store", type=Path, default=None)
    options = parser.parse_args()
    lines = {
        source.stem: newest(read_lines(source)) for source in sorted(options.out.glob("*.jsonl"))
    }
    tables = {name: table_of(name, found) for name, found in lines.items()}
    parts = [markdown(name, lines[name], tables[name]) for name in SYNTHETIC if name in lines]
    text = "\n".join([bars(lines, tables), *parts])
    print(text)
    versions = {line["tracker"] for found in lines.values() for line in found}
    if len(versions) > 1:
        print(f"These are results of {len(versions)} versions of the tracker.", file=sys.stderr)
    if options.store is not None:
        store(options.store, lines, text, tables)


def newest(lines: list[Line]) -> list[Line]:
    """Return the last line of each video, in their order."""
    last = {line["key"]: line for line in lines}
    return [last[key] for key in sorted(last)]


def table_of(name: str, lines: list[Line]) -> Line:
    """Return the figures of a set, all of its videos taken together."""
    good = [line for line in lines if "error" not in line]
    if name not in SYNTHETIC or not good:
        return {"videos": len(good), "failed": len(lines) - len(good)}
    found: Line = {"key": "all", "latching": "all", "videos": len(good)}
    found["failed"] = len(lines) - len(good)
    found |= {key: sum(line[key] for line in good) for key in SUMMED}
    measured = np.array([line["samples"] - line["lost"] for line in good], dtype=float)
    for key in POOLED:
        squares = np.array([line[key] for line in good]) ** 2
        found[key] = float(np.sqrt(np.average(squares, weights=measured)))
    for key in MEANS:
        found[key] = float(np.average([line[key] for line in good], weights=measured))
    found |= {key: max(line[key] for line in good) for key in WORST}
    found["recall"] = 1.0 - found["lost"] / found["samples"]
    found["recall_visible"] = 1.0 - found["lost_visible"] / found["samples_visible"]
    return found


def bars(lines: dict[str, list[Line]], tables: dict[str, Line]) -> str:
    """Return each bar with what was measured, the worst video in parentheses."""
    rows = ["| set | what must hold | measured | worst video | |", "|---|---|---|---|---|"]
    for name in ("moderate", "heavy"):
        good = [line for line in lines.get(name, []) if "error" not in line]
        for words, key, shape, limit, upper in BARS[name] if good else ():
            worst = (max if upper else min)(line[key] for line in good)
            holds = worst <= limit if upper else worst >= limit
            cells = [name, words, shape.format(tables[name][key]), shape.format(worst)]
            rows.append(_row([*cells, "holds" if holds else "FAILS"]))
    for line in lines.get("closed-loop", []):
        rows += [_row(cells) for cells in loop_bars(line)] if "error" not in line else []
    for line in lines.get("mouse", []):
        rows += [_row(cells) for cells in mouse_bars(line)] if "error" not in line else []
    return "\n".join([*rows, ""])


BARS: Final = {
    "moderate": (
        ("position ≤ 0.15 mm rms", "position_rms_mm", "{:.3f} mm", 0.15, True),
        ("angle ≤ 0.5° rms", "angle_rms_deg", "{:.2f}°", 0.5, True),
        ("recall ≥ 99.5 %", "recall", "{:.2%}", 0.995, False),
        ("no identity swaps", "swaps", "{}", 0, True),
    ),
    "heavy": (
        ("recall ≥ 95 % where 70 % is visible", "recall_visible", "{:.2%}", 0.95, False),
        ("no unmarked swaps", "unmarked", "{}", 0, True),
    ),
}


def loop_bars(line: Line) -> list[list[str]]:
    """Return the rows of one half hour: drag and force within 3 %, noise within 20 % or 0.02 mm."""
    rows = []
    for angle, fit in line["fits"].items():
        head = [f"closed-loop {line['key']}", f"--angle {angle}: "]
        for key, label in (("drag_coefficient", "C_d"), ("force_std_N", "σ_F")):
            off = fit[f"{key}_difference"]
            words = f"{off:+.2%}, {fit['tracked'][key]:.4g} for {fit['true'][0][key]:.4g}"
            holds = "holds" if abs(off) <= 0.03 else "FAILS"
            rows.append([head[0], f"{head[1]}{label} within 3 %", words, "", holds])
        off, share = fit["tracking_noise_difference_mm"], fit["tracking_noise_difference"]
        words = f"{1e3 * fit['tracked']['tracking_noise_m']:.4f} mm, {off:+.4f} mm or {share:+.0%}"
        holds = "holds" if abs(off) <= 0.02 or abs(share) <= 0.2 else "FAILS"
        rows.append([head[0], f"{head[1]}noise within 20 % or 0.02 mm", words, "", holds])
    return rows


def mouse_bars(line: Line) -> list[list[str]]:
    """Return the rows of the mouse."""
    lost = f"{line['lost']} of {line['frames']}, {line['far']} elsewhere"
    kept = line["lost"] == line["far"] == 0
    near = "holds" if line["median_px"] <= 5.0 else "FAILS"
    return [
        ["mouse", "median ≤ 5 px", f"{line['median_px']:.2f} px", "", near],
        ["mouse", "no loss", lost, "", "holds" if kept else "FAILS"],
    ]


def markdown(name: str, lines: list[Line], together: Line) -> str:
    """Return the table of a set as Markdown, its last row all videos together."""
    rows = [f"## {name}", "", _row(list(COLUMNS)), "|" + "---|" * len(COLUMNS)]
    rows += [_row(_cells(line)) for line in lines if "error" not in line]
    rows += [_row([str(line["key"]), line["error"]]) for line in lines if "error" in line]
    rows += [_row(_cells(together))] if together["videos"] > 1 else []
    return "\n".join([*rows, ""])


def _cells(line: Line) -> list[str]:
    shown = line | {"latching": LATCHING[line["latching"]]}
    return [
        shape.format(*(shown[key] for key in ((keys,) if isinstance(keys, str) else keys)))
        for keys, shape in COLUMNS.values()
    ]


def _row(cells: list[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def store(folder: Path, lines: dict[str, list[Line]], text: str, tables: dict[str, Line]) -> None:
    """Write tables, results and the manifest."""
    folder.mkdir(parents=True, exist_ok=True)
    write_atomic(folder / "tables.md", f"{text}\n".encode())
    write_atomic(folder / "tables.json", (json.dumps(tables, indent=1) + "\n").encode())
    write_atomic(folder / "results.csv", _csv(lines).encode())
    stored = {}
    for name, found in lines.items():
        stored[name] = folder / f"{name}.jsonl"
        words = "".join(json.dumps(line) + "\n" for line in found)
        write_atomic(stored[name], words.encode())
    facts = manifest(
        command=["python", *sys.argv],
        study=dw.Study().to_dict(),
        seeds={f"{name}-{seed}": seed for name in SEEDS for seed in SEEDS[name]},
        inputs=stored,
    )
    facts["software"]["opencv"] = _opencv()
    facts["tracker"] = sorted({line["tracker"] for found in lines.values() for line in found})
    write_manifest(folder / "manifest.json", facts)


def _csv(lines: dict[str, list[Line]]) -> str:
    """Return the plain numbers of the synthetic videos, one row each."""
    good = [line for name in SYNTHETIC for line in lines.get(name, []) if "error" not in line]
    plain = [
        {key: value for key, value in line.items() if not isinstance(value, (dict, list))}
        for line in good
    ]
    text = io.StringIO()
    if plain:
        writer = csv.DictWriter(text, list(plain[0]), extrasaction="ignore", lineterminator="\n")
        writer.writeheader()
        writer.writerows(plain)
    return text.getvalue()


def _opencv() -> str:
    import cv2

    return str(cv2.__version__)


if __name__ == "__main__":
    main()
