"""Make recordings of discs and of glued dimers: a CSV as a tracker writes it, the truth as JSON.

    python studies/bodies/recordings.py OUT --set discs|squares|ode|own|dimers [--count 20]
                                        [--first 1] [--kind paper|floating]

Worlds are drawn one after the other; one is kept if the body is seldom at the wall and if its
recording could tell C_d (`information.py` of the study of verdicts), both by the true motion alone.
`squares` are the worlds of the discs with square blocks, for the time that a fit takes. `--first`
begins with another world: discs from 101 on have been fitted by no version that was tuned. `own`
are discs of the paper's law that driftwalk itself simulates, 10 minutes each, to compare with those
of `ode`.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import shapes
from blocks import SQUARE, Body, Motion, simulate
from flows import AXIS, place, steady, uniform
from information import of_block, visited
from make import finite, tanks_of, write
from ranges import (
    ADDED_MASS,
    DRAG_COEFFICIENT,
    FORCE_INTERVAL_S,
    FORCE_STD_N,
    MASS_KG,
    ORIENTATION_NOISE_DEG,
    POSITION_NOISE_M,
    RADIUS_M,
    SAMPLE_S,
    SETTLING_S,
    SIDE_M,
    WALL_FRICTION,
    WALL_RESTITUTION,
    Kind,
)
from worlds import Block, Camera, World

SEEDS = {"discs": 81_000, "squares": 81_000, "ode": 82_000, "own": 81_000, "dimers": 83_000}
COUNTS = {"discs": 20, "squares": 8, "ode": 8, "own": 20, "dimers": 24}
MOST_WALL_SHARE = 0.3
LEAST_VISITED_SHARE = 0.1
"""Of the tank."""
AT_ONCE = 36
KINDS = ("paper", "floating")
HIDDEN_SHARES = (0.0, 0.5, 1.0)
CORRELATIONS = (0.0, 0.8)
ODE_STEP_S, OWN_STEP_S = 0.5e-3, 2.5e-3
OTHER_SEED = 0x5EED
"""The dimer of a pair has the seed of the block with these bits turned."""


def main() -> None:
    """Make the recordings that are not there."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--set", dest="which", choices=SEEDS, default="discs")
    parser.add_argument("--count", type=int, default=None)
    parser.add_argument("--first", type=int, default=1, help="number of the first world")
    parser.add_argument("--kind", choices=KINDS, help="of the discs; default: half of each")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    make = {"dimers": dimers, "ode": others, "own": others}.get(options.which, discs)
    kinds = [options.kind] if options.kind else KINDS
    make(options.out, options.which, options.count or COUNTS[options.which], options.first, kinds)


def drawn(which: str, number: int) -> World:
    """Draw a world; it depends on the seed of the set and its own number alone."""
    rng = np.random.default_rng([SEEDS[which], number])
    camera = Camera(uniform(rng, POSITION_NOISE_M), np.deg2rad(uniform(rng, ORIENTATION_NOISE_DEG)))
    floats = which != "ode" and number % 2 == 1
    # Half of the floating bodies have the added mass that a fit takes by itself.
    share = 0.5 if number % 4 == 1 else round(uniform(rng, ADDED_MASS), 3)
    body = Block(
        flow=steady(rng, sinks=0.1 if floats else 0.7, swirls=0.7 if floats else 0.2),
        drag_coefficient=uniform(rng, DRAG_COEFFICIENT),
        force_std=uniform(rng, FORCE_STD_N),
        start=complex(*place(rng, 0.08)),
        friction=uniform(rng, WALL_FRICTION),
        restitution=uniform(rng, WALL_RESTITUTION),
        floating=floats,
        added_mass=share * floats,
    )
    stated = floats and share != 0.5
    options = ["--added-mass", f"{share:.3g}"] if stated else []
    kind = Kind("floating" if floats else "paper", 0, 0)
    minutes = 20.0 if which == "dimers" or number % 3 == 0 else 10.0
    seed = int(rng.integers(2**31))
    return World(f"{which[0]}{number:03d}", kind, minutes, seed, camera, body, options)


def known(body: Body) -> list[str]:
    """Return what the user knows of a body, as options of the command."""
    shape = ["--body-shape", "disc:3cm"] if body.radius_m else ["--side", "3cm"]
    return ["--tank", "30cm", *shape, "--mass", "11.6g"]


def discs(out: Path, which: str, count: int, first: int, kinds: Sequence[str]) -> None:
    """Make recordings of discs without orientations, or of square blocks in the same tanks."""
    group = [drawn(which, first + k) for k in range(AT_ONCE)]
    group, body = [world for world in group if world.kind.name in kinds], shapes.disc()
    tanks = tanks_of(group)
    tanks.body = body
    motions = simulate(tanks, 1200.0)
    facts = [of_block(tanks, k, motions) for k in range(len(group))]
    kept = []
    for name in kinds:
        able = [k for k, fact in enumerate(facts) if could_tell(fact)]
        kept += [k for k in able if group[k].kind.name == name][: count // len(kinds)]
    if which == "squares":
        tanks = tanks.only(np.array(kept))
        tanks.body = SQUARE
        motions = simulate(tanks, 1200.0)
    for position, k in enumerate(kept):
        square = which == "squares"
        world = replace(group[k], options=known(tanks.body) + group[k].options)
        told = {} if square else facts[k]
        write_world(out, world, motions, position if square else k, told, heading=square)


def write_world(
    out: Path, world: World, motions: Motion, row: int, facts: dict[str, Any], *, heading: bool
) -> None:
    """Write the files of one world."""
    samples = round(60.0 * world.minutes / SAMPLE_S) + 1
    angle = motions.angle[row, :samples] if heading else None
    write(out, world, motions.place[row, :samples], angle, facts)
    print(world.name, world.kind.name, world.minutes, flush=True)


def could_tell(facts: dict[str, Any]) -> bool:
    """Return whether a recording could tell C_d, of a body that gets about off the wall."""
    return bool(facts["judgeable"]) and gets_about(facts["wall_share"], facts["visited_share"])


def gets_about(wall_share: float, visited_share: float) -> bool:
    """Return whether a body is seldom at the wall and stays in no eddy."""
    return wall_share < MOST_WALL_SHARE and visited_share > LEAST_VISITED_SHARE


def others(out: Path, which: str, count: int, first: int, _: Sequence[str]) -> None:
    """Make recordings of discs by the Open Dynamics Engine, or by driftwalk."""
    found, number = 0, first
    with tempfile.TemporaryDirectory() as folder:
        program = built(Path(folder)) if which == "ode" else None
        while found < count:
            world = drawn(which, number)
            number += 1
            if which == "own":
                world = replace(world, name=f"d{number - 1:03d}", minutes=10.0)
            if world.body.floating:
                continue
            if program is None:
                path = by_driftwalk(world)
            else:
                path = by_ode(program, world, Path(folder) / "case.txt")
            motions = Motion(
                path, np.gradient(path, SAMPLE_S, axis=1), np.zeros(path.shape),
                np.zeros(path.shape), np.abs(path) > 0.15 - 0.5 * 0.03 - 1e-4,
            )  # fmt: skip
            tanks = tanks_of([world])
            tanks.body = shapes.disc()
            facts = of_block(tanks, 0, motions)
            if could_tell(facts):
                found += 1
                world = replace(world, options=known(tanks.body))
                write_world(out, world, motions, 0, facts, heading=False)


def built(folder: Path) -> Path:
    """Compile the program on the Open Dynamics Engine into a folder."""
    shapes.sys.path.append(str(Path(__file__).resolve().parents[2] / "benchmarks"))
    from peer import build_peer

    return Path(build_peer(folder, "ode_recording"))


def by_driftwalk(world: World) -> npt.NDArray[np.complex128]:
    """Return the places of a disc, shape (1, samples)."""
    import driftwalk as dw
    from driftwalk.schema import build_flow_field

    body, water = world.body, world.body.flow.modes[0]
    study = dw.apply_overrides(
        dw.Study(),
        {
            "simulation.time_step_s": OWN_STEP_S,
            "block.shape": "disc",
            "block.side_m": SIDE_M,
            "block.mass_kg": MASS_KG,
            "forces.drag_coefficient": body.drag_coefficient,
            "forces.force_std_N": body.force_std,
            "tank.diameter_m": 2.0 * RADIUS_M,
            "tank.wall_friction": body.friction,
            "tank.wall_restitution": body.restitution,
            "observation.position_noise_m": 0.0,
            "observation.position_quantum_m": 0.0,
        },
    )
    field = build_flow_field(
        AXIS, AXIS, u=water.real, v=water.imag, flag=np.ones(water.shape, dtype=np.int8)
    )
    settling = round(SETTLING_S / SAMPLE_S)
    samples = settling + round(60.0 * world.minutes / SAMPLE_S) + 1
    run = dw.simulate(
        study, field, sample_time=SAMPLE_S * np.arange(samples), replicates=1, seed=world.seed,
        start=dw.simulation.Start(body.start.real, body.start.imag, 0.0),
    )  # fmt: skip
    return (run["x"].values[0, :, 0] + 1j * run["y"].values[0, :, 0])[np.newaxis, settling:]


def by_ode(program: Path, world: World, case: Path) -> npt.NDArray[np.complex128]:
    """Return the places of a disc, shape (1, samples)."""
    import subprocess

    from peer import write_case

    import driftwalk as dw

    body, water = world.body, world.body.flow.modes[0]
    study = dw.apply_overrides(
        dw.Study(),
        {
            "simulation.time_step_s": ODE_STEP_S,
            "tank.wall_friction": body.friction,
            "tank.wall_restitution": body.restitution,
        },
    )
    start = [body.start.real, body.start.imag, 0.0, 0.0, 0.0, 0.0, body.drag_coefficient]
    write_case(
        case, study, axis=AXIS, u=water.real, v=water.imag,
        worlds=np.array([[[*start, body.force_std]]]),
        steps_per_sample=round(SAMPLE_S / ODE_STEP_S),
    )  # fmt: skip
    numbers = [
        world.seed,
        round(FORCE_INTERVAL_S / ODE_STEP_S),
        round(SETTLING_S / SAMPLE_S),
        round(60.0 * world.minutes / SAMPLE_S) + 1,
    ]
    command = [program, case, *map(str, numbers), "disc=1"]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    x, y, _ = np.array(done.stdout.split(), dtype=float).reshape(-1, 3).T
    return (x + 1j * y)[np.newaxis]


def dimers(out: Path, which: str, count: int, first: int, _: Sequence[str]) -> None:
    """Make pairs of recordings: a block, and a glued dimer in the same flow."""
    group = [drawn(which, first + k) for k in range(count + count // 3)]
    tanks = tanks_of(group)
    singles = simulate(tanks, 1200.0)
    able = [k for k in range(len(group)) if could_tell(of_block(tanks, k, singles))]
    # Hidden shares take turns, then correlations.
    hidden = np.array([HIDDEN_SHARES[at % 3] for at in range(len(able))])
    correlation = np.array([CORRELATIONS[(at // 3) % 2] for at in range(len(able))])
    glued = tanks.only(np.array(able))
    glued.seed = [seed ^ OTHER_SEED for seed in glued.seed]
    glued.body, glued.correlation = shapes.dimer(hidden), correlation
    motions, found = simulate(glued, 1200.0), 0
    for row, k in enumerate(able):
        about = gets_about(float(motions.touched[row].mean()), visited(motions.place[row]))
        if found < count and about:
            found += 1
            write_pair(
                out, group[k], (singles, k), (motions, row), float(hidden[row]),
                float(correlation[row]),
            )  # fmt: skip


def write_pair(
    out: Path, world: World, one: tuple[Motion, int], two: tuple[Motion, int], hidden: float,
    correlation: float,
) -> None:  # fmt: skip
    """Write the files of a pair, and what is true of both."""
    extra = world.options
    single = replace(
        world, name=f"{world.name}-block", options=["--tank", "30cm", "--side", "3cm",
        "--mass", "11.6g", *extra],
    )  # fmt: skip
    glued = replace(
        single, name=f"{world.name}-dimer", seed=world.seed ^ OTHER_SEED,
        options=["--tank", "30cm", "--body-shape", "xx:3cm", "--mass", "23.2g", *extra],
    )  # fmt: skip
    for part, (motions, row) in ((single, one), (glued, two)):
        write_world(out, part, motions, row, {}, heading=True)
    body = {name: finite(value) for name, value in asdict(world.body).items() if name != "flow"}
    truth = {
        "name": world.name,
        "kind": world.kind.name,
        "hidden_share": hidden,
        "correlation": correlation,
        "body": body,
    }
    text = json.dumps(truth, indent=1)
    (out / f"{world.name}-pair.json").write_text(f"{text}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
