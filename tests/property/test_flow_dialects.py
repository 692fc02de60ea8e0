"""Velocity fields in random dialects: right to the last digit, or refused; never silently other."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from dialects import part_of_today

from driftwalk.core.errors import InputError
from driftwalk.flow import flow_format, load_flow
from driftwalk.schema import FLAGS

NAMES: list[tuple[str, str, str, str]] = [
    ("x", "y", "u", "v"),
    ("X", "Y", "Vx", "Vy"),
    ("pos_x", "pos_y", "vel_x", "vel_y"),
    ("x position", "y position", "Velocity u", "Velocity v"),
    ("X-Koordinate", "Y-Koordinate", "Geschwindigkeit u", "Geschwindigkeit v"),
    ("position x", "position y", "vitesse x", "vitesse y"),
    ("Position_X", "Position_Y", "ux", "uy"),
    ("x", "y", "velocidad x", "velocidad y"),
]
UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "px": 2e-4}
MISSING = ["NaN", "nan", "", "-", "--", "n/a", "1.#QNAN", "-nan(ind)", "<NA>", "missing"]
MORE = ["vorticity [1/s]", "SNR", "velocity magnitude [m/s]", "comment"]


def dialect(rng: np.random.Generator, path: Path) -> tuple[dict[str, Any], Any, Any, Any, Any]:
    """Write a field in a random dialect; return how to read it, and what it holds in SI."""
    nx, ny = rng.integers(3, 7, 2)
    spacing, unit = float(rng.choice([1.0, 2.5, 16.0])), str(rng.choice(list(UNITS)))
    x, y = spacing * np.arange(1, nx + 1), spacing * np.arange(1, ny + 1)
    velocity = np.round(rng.normal(size=(ny, nx, 2)), 4)
    velocity[np.abs(velocity).max(axis=2) == 0.0] = 1.0  # 0, 0 is what DaVis writes of no vector
    lost = rng.random((ny, nx)) < rng.choice([0.0, 0.2])
    lost[0, 0] = False
    delimiter = str(rng.choice([",", ";", "\t"]))
    comma = delimiter != "," and bool(rng.integers(2))
    top_first, by_columns = bool(rng.integers(2)), bool(rng.integers(2))
    names = NAMES[rng.integers(len(NAMES))]
    speed = f"{unit}/s" if unit != "px" else str(rng.choice(["px/s", "px/frame"]))
    units = (unit, unit, speed, speed)
    under = bool(rng.integers(2))
    brackets = str(rng.choice(["[]", "()"]))
    called = [
        one if under else f"{one} {brackets[0]}{what}{brackets[1]}"
        for one, what in zip(names, units, strict=True)
    ]
    extra = [str(one) for one in rng.permutation(MORE)[: rng.integers(0, 3)]]
    order = rng.permutation(4 + len(extra))
    head = [f"measured by A, run {k}" for k in range(rng.integers(0, 4))]
    head.append(delimiter.join(([*called, *extra])[at] for at in order))
    if under:
        shown = [*units, *["-"] * len(extra)]
        head.append(delimiter.join(shown[at] for at in order))
    down = range(ny)[::-1] if top_first else range(ny)
    places = [(j, i) for j in down for i in range(nx)]
    places = [(j, i) for i in range(nx) for j in down] if by_columns else places
    mark, rows = str(rng.choice(MISSING)), []
    for j, i in places:
        gone = bool(lost[j, i])
        fields = [f"{x[i]:g}", f"{y[j]:g}"]
        fields += [mark, mark] if gone else [f"{one:.4f}" for one in velocity[j, i]]
        fields = [one.replace(".", ",") if comma and one != mark else one for one in fields]
        fields += ["ok" if one == "comment" else "0" for one in extra]
        rows.append(delimiter.join(fields[at] for at in order))
    ending = str(rng.choice(["\n", "\r\n"]))
    encoding = str(rng.choice(["utf-8", "utf-8-sig", "utf-16"]))
    path.write_bytes((ending.join([*head, *rows]) + ending).encode(encoding))
    options: dict[str, Any] = {"metres_per_pixel": UNITS["px"]} if unit == "px" else {}
    options |= {"frame_interval": 0.01} if speed == "px/frame" else {}
    factor = UNITS[unit] * (100.0 if speed == "px/frame" else 1.0)
    turned = unit == "px" and not top_first
    sign = -1 if turned else 1
    field = factor * velocity * [1.0, sign]
    return options, UNITS[unit] * x, (sign * UNITS[unit] * y)[::sign], field[::sign], lost[::sign]


@pytest.mark.parametrize(
    "seeds",
    [range(40), pytest.param(part_of_today(3000), marks=pytest.mark.slow)],
    ids=["some", "many"],
)
def test_random_dialects(tmp_path: Path, seeds: range) -> None:
    refused = 0
    for seed in seeds:
        path = tmp_path / "field.txt"
        options, x, y, velocity, lost = dialect(np.random.default_rng(seed), path)
        try:
            field = load_flow(path, **options)
        except InputError:
            refused += 1
            continue
        assert flow_format(path) is not None, seed
        np.testing.assert_allclose(field.x, x, rtol=1e-9, err_msg=str(seed))
        np.testing.assert_allclose(field.y, y, rtol=1e-9, err_msg=str(seed))
        known = field.flag.values == FLAGS["measured"]
        np.testing.assert_array_equal(known, ~lost, err_msg=str(seed))
        for at, found in enumerate((field.u, field.v)):
            np.testing.assert_allclose(
                found.values[known], velocity[..., at][known], rtol=1e-9, err_msg=str(seed)
            )
    assert refused <= 0.02 * len(seeds)
