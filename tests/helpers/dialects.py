"""Recordings in random dialects of headed text, with the truth that they were written from."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "dm": 0.1, "ft": 0.3048, "in": 0.0254, "yd": 0.9144}
LENGTH_WORDS = {"mm": ["mm", "millimetres"], "in": ["in", "inch"], "ft": ["ft", "feet"]}
NO_LENGTHS = ["bl", "norm", "grid", "furlong", "rel", "zz"]
"""Words that are no unit of length: all are to be refused."""
TIMES = {"s": 1.0, "ms": 1e3, "us": 1e6, "min": 1 / 60, "h": 1 / 3600}
ANGLES = {
    "rad": 1.0,
    "deg": np.pi / 180,
    "gon": np.pi / 200,
    "turns": 2 * np.pi,
    "ddeg": np.pi / 1800,
}
NAMES = {
    "en": ("time", "frame", "id", "heading"),
    "de": ("Zeit", "Bild", "Spur", "Winkel"),
    "fr": ("temps", "trame", "piste", "orientation"),
    "es": ("tiempo", "fotograma", "cuerpo", "ángulo"),
    "it": ("tempo", "fotogramma", "traccia", "angolo"),
    "none": ("Qa", "Qb", "Qc", "Qd"),
}
MARKS = [
    "",
    "NaN",
    "nan",
    "-",
    "--",
    ".",
    "n/a",
    "missing",
    "1.#QNAN",
    "-nan(ind)",
    "#DIV/0!",
    "<NA>",
]
HEADS = [
    "Experiment 7",
    "Recorded by: A. Nobody",
    "camera;12",
    "# made by a tracker",
    "key,value,3",
]


ALL, PARTS = "DRIFTWALK_ALL_DIALECTS", 50
DAY_S = 86_400


def part_of_today(number: int) -> range:
    """Return the seeds below a number that are tried today: a fiftieth, and all within fifty days.

    All of them where the environment asks for it, as `make fuzz-dialects` does.
    """
    if os.environ.get(ALL):
        return range(number)
    return range(int(time.time()) // DAY_S % PARTS, number, PARTS)


@dataclass
class Dialect:
    """A recording as text, how to load it, and what has to come out."""

    text: bytes
    options: dict[str, Any]
    time: Array
    x: dict[str, Array]
    """By body; in metres, y up."""
    y: dict[str, Array]
    theta: dict[str, Array] | None
    said: list[str] = field(default_factory=list)
    """What was drawn, for the message of a failure."""

    def write(self, folder: Path) -> Path:
        """Write the text as a file."""
        path = folder / "dialect.csv"
        path.write_bytes(self.text)
        return path


def draw(seed: int) -> Dialect:  # noqa: C901
    """Return the recording of a seed."""
    random = np.random.default_rng(seed)

    def one(values: Any) -> Any:
        return values[int(random.integers(len(values)))]

    rows, count = int(random.integers(12, 30)), int(random.choice([1, 1, 2, 3]))
    delimiter = one([",", ";", "\t", " "])
    decimal = one([".", ","]) if delimiter in (";", "\t") else "."
    language = one([*NAMES, "en", "de", "fr", "es", "it"])
    time_name, frame_name, body_name, angle_name = NAMES[language]
    stacked = bool(random.random() < 0.5) if count > 1 else bool(random.random() < 0.3)
    pixels = bool(random.random() < 0.3)
    unit = "px" if pixels else one([*LENGTHS])
    unknown = one(NO_LENGTHS) if random.random() < 0.1 and not pixels else ""
    word = unknown or one(LENGTH_WORDS.get(unit, [unit]))
    kind = one(["t", "t", "frame", "sec", "none"])
    time_unit = one([*TIMES])
    has_angle = bool(random.random() < 0.5)
    angle_unit = one([*ANGLES])
    placing = one(["suffix", "round", "square", "row"])
    if delimiter == " " and placing != "row":
        placing = "suffix"
    mark = one(MARKS if delimiter != " " else MARKS[1:])
    lost = random.random(rows) < 0.1 if random.random() < 0.5 else np.zeros(rows, dtype=bool)

    step = 0.04
    index = np.cumsum(np.append(0, random.choice([1, 1, 1, 1, 2], size=rows - 1)))
    if kind == "none":
        index = np.arange(rows)
    start = int(random.integers(0, 100))
    phase = 0.3 * np.arange(rows) + random.uniform(0, 6)
    bodies = (
        [str(k + 1) for k in range(count)] if random.random() < 0.5 else ["a", "b", "c"][:count]
    )
    truth: dict[str, tuple[list[str], list[str], list[str]]] = {}
    decimals = int(random.integers(3, 7))
    for place, body in enumerate(bodies):
        x = 300 + 200 * np.cos(phase + place) + random.normal(0, 0.5, rows)
        y = 250 + 200 * np.sin(phase + place) + random.normal(0, 0.5, rows)
        scale = 1.0 if pixels else 1e-3 / LENGTHS[unit]
        angle = (phase + place) % 6.0 / ANGLES[angle_unit]
        truth[body] = (
            [f"{value * scale:.{decimals}f}" for value in x],
            [f"{value * scale:.{decimals}f}" for value in y],
            [f"{value:.6f}" for value in angle],
        )

    # Columns: name, unit, and the texts of each row of one body; a clock is the same for all.
    clock: list[tuple[str, str, list[str]]] = []
    options: dict[str, Any] = {"metres_per_pixel": 1e-3} if pixels else {}
    if kind == "t":
        ticks = TIMES[time_unit]
        texts = [f"{(start + k) * step * ticks:.9f}" for k in index]
        clock = [(time_name, time_unit, texts)]
        times = np.array([float(text) / ticks for text in texts])
    elif kind == "sec":
        nanos = [(start + int(k)) * 40_000_000 for k in index]
        clock = [("sec", "", [str(1_700_000_000 + n // 10**9) for n in nanos])]
        clock.append(("nanosec", "", [str(n % 10**9) for n in nanos]))
        times = np.array([(n - nanos[0]) / 1e9 for n in nanos])
    else:
        options["frame_rate"] = 25.0
        frames = [start + int(k) for k in index]
        clock = [(frame_name, "", [str(k) for k in frames])] if kind == "frame" else []
        times = np.array(frames if kind == "frame" else np.arange(rows)) / 25.0

    def columns_of(body: str, named: bool) -> list[tuple[str, str, list[str]]]:
        x, y, theta = truth[body]
        style = styles[0]
        names = [
            (f"{q}{body}" if body.isdecimal() else (f"{q}_{body}" if style else f"{body}_{q}"))
            if named
            else q
            for q in ("x", "y", angle_name)
        ]
        hidden = [
            [mark if gone else text for text, gone in zip(of, lost, strict=True)]
            for of in (x, y, theta)
        ]
        found = [(names[0], word, hidden[0]), (names[1], word, hidden[1])]
        return found + ([(names[2], angle_unit, hidden[2])] if has_angle else [])

    styles = [bool(random.random() < 0.5)]
    table: list[tuple[str, str, list[str]]] = []
    if stacked:
        per_body = [columns_of(body, False) for body in bodies]
        order = [(b, r) for b in range(count) for r in range(rows)]
        if random.random() < 0.5:
            order = [(b, r) for r in range(rows) for b in range(count)]
        for at, (name, its_unit, _) in enumerate(per_body[0]):
            table.append((name, its_unit, [per_body[b][at][2][r] for b, r in order]))
        table += [(name, its_unit, [texts[r] for _, r in order]) for name, its_unit, texts in clock]
        table.append((body_name, "", [bodies[b] for b, _ in order]))
    else:
        named = count > 1
        table = [column for body in bodies for column in columns_of(body, named)] + clock
        order = [(0, r) for r in range(rows)]
    for extra in ("area", "speed", "x_ref", "y_ref", "conf", "vel_x", "vel_y", "x_dot", "y_dot"):
        if random.random() < 0.12:
            table.append((extra, "", [f"{value:.3f}" for value in random.normal(5, 1, len(order))]))
    if {"x_ref", "y_ref"} & {name for name, _, _ in table} and random.random() < 0.5:
        table = [one_ for one_ in table if one_[0] not in ("x_ref", "y_ref")]
    random.shuffle(table)

    def header(name: str, its_unit: str) -> str:
        if not its_unit or placing == "row":
            return name
        return {"suffix": f"{name}_{its_unit}", "round": f"{name} ({its_unit})"}.get(
            placing, f"{name} [{its_unit}]"
        )

    lines = [one(HEADS) for _ in range(int(random.choice([0, 0, 0, 1, 3, 5])))]
    lines.append(delimiter.join(header(name, its_unit) for name, its_unit, _ in table))
    if placing == "row":
        lines.append(delimiter.join(its_unit or "-" for _, its_unit, _ in table))
    for row in range(len(order)):
        texts = [texts[row] for _, _, texts in table]
        lines.append(
            delimiter.join(text.replace(".", decimal) if text != mark else text for text in texts)
        )
    encoding = one(["utf-8", "utf-8-sig", "utf-16", "cp1252"])
    end = one(["\n", "\r\n"])
    factor = 1e-3 if pixels else LENGTHS[unit]
    sign = -1.0 if pixels else 1.0
    gone = np.where(lost, np.nan, 1.0)
    names = {body: (body if (stacked or count > 1) else "0") for body in bodies}
    return Dialect(
        text=(end.join(lines) + end).encode(encoding),
        options=options,
        time=times,
        x={names[b]: np.array([float(v) for v in truth[b][0]]) * factor * gone for b in bodies},
        y={
            names[b]: np.array([float(v) for v in truth[b][1]]) * factor * sign * gone
            for b in bodies
        },
        theta={
            names[b]: np.array([float(v) for v in truth[b][2]]) * ANGLES[angle_unit] * sign * gone
            for b in bodies
        }
        if has_angle
        else None,
        said=[f"{language=} {unit=} {word=} {kind=} {stacked=} {placing=} {mark=} {encoding=}"],
    )


def verdict(dialect: Dialect, folder: Path) -> str:  # noqa: C901
    """Load a recording; return "right", "refused: …", or what is other than it was written."""
    from driftwalk.core.errors import InputError
    from driftwalk.record import load
    from driftwalk.schema import body_names

    try:
        found = load(dialect.write(folder), **dialect.options)
    except InputError as error:
        return f"refused: {error}"
    if len(dialect.x) == 1 and body_names(found) == ["0"]:
        found = found.assign_coords(body=list(dialect.x))  # a lone body may be without a name
    if sorted(body_names(found)) != sorted(dialect.x):
        return f"bodies {body_names(found)}, not {sorted(dialect.x)}"
    time = found["time"].values
    if time.size != dialect.time.size or not np.allclose(
        time - time[0], dialect.time - dialect.time[0], rtol=0.0, atol=1e-8
    ):
        return f"times {time[:4]}, not {dialect.time[:4]}"
    for body in dialect.x:
        for axis, of in (("x", dialect.x), ("y", dialect.y)):
            values = found[axis].sel(body=body).values
            if not np.allclose(values, of[body], rtol=4e-16, atol=0.0, equal_nan=True):
                return f"{axis} of {body}: {values[:3]}, not {of[body][:3]}"
        angles = found["theta"].sel(body=body).values if "theta" in found else None
        has = angles is not None and bool(np.isfinite(angles).any())
        if dialect.theta is None:
            if has:
                return "an orientation that is not there"
        elif has and angles is not None:
            apart = np.angle(np.exp(1j * (angles - dialect.theta[body])))
            if not np.nanmax(np.abs(apart)) < 1e-9:
                return f"theta of {body}: {angles[:3]}, not {dialect.theta[body][:3]}"
        elif "no orientation is read" not in found.attrs["counts"]:
            return "an orientation that is lost"
    return "right"
