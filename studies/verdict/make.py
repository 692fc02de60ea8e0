"""Make the recordings of a set: a CSV as a tracker writes it, and the truth as JSON.

    python studies/verdict/make.py OUT [--set development] [--most-minutes 30] [--workers 2]

The CSV of `b017` has time, place and orientation; its JSON has the law, the numbers, the options
that its user knows, and whether a recording of this length could tell (`judgeable`).
"""

from __future__ import annotations

import argparse
import csv
import json
import math
from collections import defaultdict
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from pathlib import Path
from typing import Any

import blocks
import information
import numpy as np
import numpy.typing as npt
import walkers
from flows import Flow
from ranges import SAMPLE_S, SEEDS
from walkers import Walker
from worlds import LAWS, Block, Camera, World, numbers_of, worlds

AT_ONCE = 60
"""Blocks that are simulated together at most."""


def main() -> None:
    """Make the recordings that are not there."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--set", dest="which", choices=SEEDS, default="development")
    parser.add_argument("--most-minutes", type=float, default=math.inf)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    wanted = [
        world
        for world in worlds(options.which, options.most_minutes)
        if not (options.out / f"{world.name}.json").exists()
    ]
    with ProcessPoolExecutor(options.workers) as pool:
        for names in pool.map(make, groups(wanted), [options.out] * len(groups(wanted))):
            print(*names, flush=True)


def groups(wanted: list[World]) -> list[list[World]]:
    """Return worlds to simulate together: steady flows of one length, and those that change.

    The water that carries blocks has a finer lattice: floating bodies are simulated apart.
    """
    alike: dict[tuple[Any, ...], list[World]] = defaultdict(list)
    for world in wanted:
        body = world.body
        if isinstance(body, Block):
            length = world.minutes if len(body.flow.modes) == 1 else "changing"
            alike[(length, body.floating)].append(world)
        else:
            alike[(world.name,)].append(world)
    found = [
        group[k : k + AT_ONCE] for group in alike.values() for k in range(0, len(group), AT_ONCE)
    ]
    return sorted(found, key=lambda group: -group[0].minutes * len(group))


def make(group: list[World], out: Path) -> list[str]:
    """Simulate some worlds and write their files."""
    if isinstance(group[0].body, Block):
        tanks = tanks_of(group)
        longest = blocks.simulate(tanks, 60.0 * max(world.minutes for world in group))
        for k, world in enumerate(group):
            samples = round(60.0 * world.minutes / SAMPLE_S) + 1
            motion = blocks.Motion(*(part[:, :samples] for part in longest))
            facts = information.of_block(tanks, k, motion)
            write(out, world, motion.place[k], motion.angle[k], facts)
    else:
        for world in group:
            place, touched = walkers.simulate(world.body, 60.0 * world.minutes, world.seed)
            facts = information.of_walker(world.body, 60.0 * world.minutes)
            wall = float(touched.mean())
            facts["judgeable"] = facts["judgeable"] and wall < information.MOST_WALKER_WALL_SHARE
            facts |= {"wall_share": wall, "visited_share": information.visited(place)}
            write(out, world, place, None, facts)
    return [world.name for world in group]


def tanks_of(group: list[World]) -> blocks.Tanks:
    """Return the tanks of some worlds as one."""
    bodies = [world.body for world in group]
    modes = max(len(body.flow.modes) for body in bodies)
    names = ("drag_coefficient", "force_std", "added_mass", "floating", "drag_power",
             "force_memory", "growth", "pulse", "pulse_period", "friction",
             "restitution")  # fmt: skip
    return blocks.Tanks(
        flow=[padded(body.flow, modes) for body in bodies],
        seed=[world.seed for world in group],
        start=np.array([body.start for body in bodies]),
        **{name: np.array([getattr(body, name) for body in bodies]) for name in names},
    )


def padded(flow: Flow, modes: int) -> Flow:
    """Return a flow with modes of no velocity added."""
    missing = modes - len(flow.modes)
    return flow._replace(modes=np.pad(flow.modes, ((0, missing), (0, 0), (0, 0))))


def write(
    out: Path,
    world: World,
    place: npt.NDArray[np.complex128],
    angle: npt.NDArray[np.float64] | None,
    facts: dict[str, Any],
) -> None:
    """Write the CSV of the camera and the JSON of the truth."""
    rng = np.random.default_rng([world.seed, 1])
    columns = {"t": SAMPLE_S * np.arange(place.size), "x": place.real, "y": place.imag}
    if angle is not None:
        columns["theta"] = angle
    seen = photographed(columns, world.camera, rng)
    with (out / f"{world.name}.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(seen)
        writer.writerows(
            [f"{t:.3f}", *(f"{value:.6f}" for value in rest)]
            for t, *rest in zip(*seen.values(), strict=True)
        )
    text = json.dumps(truth(world) | facts, indent=1, ensure_ascii=False, allow_nan=False)
    (out / f"{world.name}.json").write_text(f"{text}\n", encoding="utf-8")


def photographed(
    true: dict[str, npt.NDArray[np.float64]], camera: Camera, rng: np.random.Generator
) -> dict[str, npt.NDArray[np.float64]]:
    """Add noise and outliers, and drop frames."""
    seen = {name: values.copy() for name, values in true.items()}
    count = seen["t"].size
    for axis in ("x", "y"):
        seen[axis] += camera.position_noise * rng.normal(size=count)
    wrong = rng.uniform(size=count) < camera.outliers
    off = camera.outlier_m * wrong * np.exp(1j * rng.uniform(0.0, 2.0 * np.pi, count))
    seen["x"] += off.real
    seen["y"] += off.imag
    if "theta" in seen:
        turned = seen["theta"] + camera.orientation_noise * rng.normal(size=count)
        seen["theta"] = np.angle(np.exp(1j * turned))
    kept = rng.uniform(size=count) >= camera.dropped
    return {name: values[kept] for name, values in seen.items()}


def truth(world: World) -> dict[str, Any]:
    """Return what is true of a recording, and what its user knows."""
    body = {name: finite(value) for name, value in asdict(world.body).items() if name != "flow"}
    facts = {
        "name": world.name,
        "kind": world.kind.name,
        "command": "fit" if isinstance(world.body, Block) else "compare-models",
        "options": world.options,
        "in_family": world.kind.in_family,
        "model": "block" if isinstance(world.body, Block) else LAWS.get(world.kind.name),
        "minutes": world.minutes,
        "camera": asdict(world.camera),
        "body": body,
    }
    if isinstance(world.body, Walker):
        facts["numbers"] = numbers_of(world.kind.name, world.body)
    elif len(world.body.flow.modes) > 1:
        facts["period_s"] = world.body.flow.period_s
    return facts


def finite(value: Any) -> Any:
    """Return a number as JSON knows it."""
    if isinstance(value, complex):
        return [value.real, value.imag]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value


if __name__ == "__main__":
    main()
