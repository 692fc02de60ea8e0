"""The tables of what a fit and its check find: misfits by size, and false alarms.

    python studies/misfit/power.py OUT [--store FOLDER]

Reads `sizes.jsonl` and `right.jsonl` in OUT (`run.py --set sizes`, `--set right`) and prints two
tables in Markdown; `--store` writes both, and the results.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from right import FIRST_SEED as FIRST_RIGHT_SEED
from run import FIRST_SEED, SETS, current, file_of

import driftwalk as dw
from driftwalk.core.files.atomic import write_atomic
from driftwalk.core.provenance import manifest, write_manifest
from driftwalk.likelihood.check.criteria import MODEL_CHECK
from driftwalk.likelihood.law.forward_selection import least_effects
from driftwalk.schema.answers.force_law import FORWARD_SELECTION

Lines = Sequence[dict[str, Any]]

NAMED: Final[dict[str, tuple[str, ...]]] = {
    "power of the drag": ("drag_power", "linear_drag"),
    "linear drag": ("drag_power", "linear_drag"),
    "memory of the force": ("force_memory",),
    "flow grows": ("flow_strength_change",),
    "pulses of 10 s": ("pulse_amplitude",),
    "jitter of the stamps": ("time_stamp_noise",),
    "orientation off": ("orientation_offset",),
    "marker off": ("marker_x", "marker_y"),
}
"""Numbers of a fit that name a kind of misfit,"""
WARNED: Final = {
    "positions off by 5 mm": "mistakes of a tracker",
    "frames dropped": "frames are missing",
}
"""or words of its warnings."""
MOST_WALL_SHARE: Final = 0.3
SHOWN: Final = {
    "drag_power": ("power of the drag, off 2", 1.0, ""),
    "linear_share": ("linear share of the drag at a side a second", 1e2, "%"),
    "force_memory": ("memory of the force", 1.0, "s"),
    "strength_1": ("change of the flow, from first to last", 2e2, "%"),
    "time_variance": ("jitter of the stamps", 1e3, "ms"),
    "angle_offset": ("orientation off", math.degrees(1.0), "°"),
    "marker_x": ("marker off", 1e3, "mm"),
}
"""Words, factor and unit of the numbers of a fit."""
SIGMAS: Final = {
    "force_memory": FORWARD_SELECTION.memory_sigmas,
    "strength_1": math.sqrt(FORWARD_SELECTION.strength_chi_squared),
}
"""Standard deviations that open a number, where they are others than
`FORWARD_SELECTION.opened_sigmas`."""


def main() -> None:
    """Print the tables, and store them when asked to."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--store", type=Path, default=None)
    options = parser.parse_args()
    found = {kind: _ordered(current(options.out / file_of(kind))) for kind in ("sizes", "right")}
    tables = {
        "sizes": sizes_table(found["sizes"]),
        "right": right_table(found["right"]),
        "limits": limits_table(found["right"]),
    }
    print("\n\n".join(tables.values()))
    if options.store is not None:
        options.store.mkdir(parents=True, exist_ok=True)
        for kind, text in tables.items():
            write_atomic(options.store / f"{kind}.md", f"{text}\n".encode())
        for kind, results in found.items():
            lines = "".join(json.dumps(one, ensure_ascii=False) + "\n" for one in results)
            write_atomic(options.store / file_of(kind), lines.encode())
        facts = manifest(
            command=["python", *sys.argv],
            study=dw.Study().to_dict(),
            seeds={"first_world": FIRST_SEED, "first_right_world": FIRST_RIGHT_SEED},
            inputs={kind: options.store / file_of(kind) for kind in found},
        )
        write_manifest(options.store / "power-manifest.json", facts)


def _ordered(lines: Lines) -> Lines:
    return sorted(lines, key=lambda one: (one["minutes"], one["case"], one["world"]))


def sizes_table(lines: Lines) -> str:
    """Return how often each misfit is named or makes the check fail, by the length."""
    lengths = sorted({one["minutes"] for one in lines})
    rows = [["misfit"]]
    for minutes in lengths:
        rows[0] += [f"{minutes:g} min: named", "or check fails", "C_d error"]
    rows.append(["---"] * len(rows[0]))
    for case in SETS["sizes"]:
        row = [case]
        for minutes in lengths:
            found = [one for one in lines if (one["case"], one["minutes"]) == (case, minutes)]
            fitted = [one for one in found if "error" not in one]
            names = [is_named(case, one) for one in fitted]
            failed = [is_rejected(one) for one in fitted]
            either = sum(a or b for a, b in zip(names, failed, strict=True))
            errors = [abs(one["drag_coefficient_error"]) for one in fitted]
            refused = len(found) - len(fitted)
            words = f", {refused} refused" if refused else ""
            row += [f"{sum(names)} of {len(found)}", f"{either} of {len(found)}{words}"]
            row.append(f"{np.median(errors):.1%}" if errors else "–")
        rows.append(row)
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def limits_table(lines: Lines) -> str:
    """Return from which size on a fit names a departure, in worlds that have none.

    The score test has to find it so many standard deviations from the model, and it has to be large
    enough to be worth a number.
    """
    least = least_effects(dw.Study().block.side_m)
    lengths = sorted({one["minutes"] for one in lines if "departure_std" in one})
    rows = [["number", *(f"{minutes:g} min" for minutes in lengths), "but at least"]]
    rows.append(["---"] * len(rows[0]))
    for name, (words, factor, unit) in SHOWN.items():
        row = [words]
        for minutes in lengths:
            std = [
                one["departure_std"][name]
                for one in lines
                if one["minutes"] == minutes and name in one.get("departure_std", {})
            ]
            size = np.array(
                [
                    _size(name, SIGMAS.get(name, FORWARD_SELECTION.opened_sigmas) * one)
                    for one in std
                ]
            )
            row.append(
                f"{factor * np.median(size):.2g} ({factor * size.min():.2g} to "
                f"{factor * size.max():.2g}) {unit}"
            )
        rows.append([*row, f"{factor * _size(name, least[name]):.2g} {unit}"])
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def _size(name: str, value: float) -> float:
    """Return the size of a number; of the stamps' variance that of their jitter."""
    return math.sqrt(value) if name == "time_variance" else value


def is_named(case: str, line: dict[str, Any]) -> bool:
    """Return whether a fit names what is not as the model says."""
    kind = case.split(":")[0]
    if kind == "floating body":
        return bool(line["law"] == "floating body")
    if kind in WARNED:
        return any(WARNED[kind] in text for text in line["warnings"])
    return bool(set(NAMED[kind]) & set(line["numbers"]))


def is_rejected(line: dict[str, Any]) -> bool:
    """Return whether the check fails, at the level that it has now."""
    return bool(line.get("least_p_value", 1.0) < MODEL_CHECK.level)


def right_table(lines: Lines) -> str:
    """Return how often the check fails on worlds that are as the model says."""
    rows = [
        [
            "length",
            "at the wall",
            "recordings",
            "check fails",
            "number opened",
            "C_d held",
            "σ_F held",
        ]
    ]
    rows.append(["---"] * len(rows[0]))
    for minutes in sorted({one["minutes"] for one in lines}):
        for far in (True, False):
            found = [
                one
                for one in lines
                if one["minutes"] == minutes
                and (one["wall_share"] < MOST_WALL_SHARE) == far
                and "error" not in one
            ]
            if found:
                share = "below 30 %" if far else "30 % and more"
                counts = (
                    sum(is_rejected(one) for one in found),
                    sum(bool(one["numbers"]) or one["law"] != "paper" for one in found),
                    sum(one["drag_coefficient_covered"] for one in found),
                    sum(one["force_std_covered"] for one in found),
                )
                rows.append([f"{minutes:g} min", share, str(len(found)), *map(str, counts)])
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


if __name__ == "__main__":
    main()
