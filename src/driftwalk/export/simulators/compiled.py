"""The export to simulators whose plugins are compiled: the force as C, its files, its proof."""

from __future__ import annotations

import json
import os
import re
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.export.simulators.block import Block, read_block
from driftwalk.export.simulators.parts import (
    Folder,
    last_line,
    run_program,
    stored_text,
    wall_pieces,
    words_of,
    write_common,
    write_numbers,
)
from driftwalk.export.simulators.reference import NO_PATH, forces_of, reference_of
from driftwalk.export.target import Source, Verification


def write_plugin(
    source: Source,
    folder: Path,
    name: str,
    sources: str,
    write_world: Callable[[Folder, Block], None],
) -> list[Path]:
    """Write the block of a run for a simulator, its plugin into a subfolder, and return the files.

    The plugin's force is C, with the numbers of the model; ``verify`` holds what proves it:
    driftwalk's numbers, and what compares them.
    """
    block = read_block(source)
    made = Folder(folder)
    write_common(made, block)
    write_world(made, block)
    write_force(made, block, sources)
    made.copy("force/verify.c", "verify/verify.c")
    made.text("verify/reference.txt", _reference_text(block))
    made.fill(f"{name}/README.md", "README.md", words_of(block))
    return made.files


def write_force(folder: Folder, block: Block, sources: str) -> None:
    """Write the force as C into a subfolder, and the numbers of the model."""
    write_numbers(folder, block)
    for name in ("floating_block.h", "floating_block.c"):
        folder.copy(f"force/{name}", f"{sources}/{name}")
    folder.text(f"{sources}/model_data.c", model_data(block))


def model_data(block: Block) -> str:
    """Return the model as a C file: its numbers, and the nodes of its flow."""
    nodes, said = block.nodes(), block.numbers()
    x, y = nodes["x_m"], nodes["y_m"]
    names = {"u": "u_m_s", "v": "v_m_s", "acceleration_x": "ax_m_s2", "acceleration_y": "ay_m_s2"}
    tables = {name: nodes[key] for name, key in names.items() if key in nodes}
    # The names in C are the keys of block.json without their units.
    unit = re.compile("_(m|kg|s|N|m_s|kg_s|kg_m2|kg_m3)$")
    numbers: dict[str, Any] = {
        **{unit.sub("", key): value for key, value in said.items()},
        "seed": f"UINT64_C({said['seed']})",
        "columns": x.size,
        "rows": y.size,
        "origin_x": float(x[0]),
        "origin_y": float(y[0]),
        "spacing_x": float((x[-1] - x[0]) / (x.size - 1)),
        "spacing_y": float((y[-1] - y[0]) / (y.size - 1)),
        **{name: name if name in tables else "0" for name in names},
    }
    lines = ["/* Written by driftwalk: the model in SI units; its keys are in floating_block.h. */"]
    lines += ['#include "floating_block.h"', ""]
    for name, values in tables.items():
        rows = [f"  {', '.join(repr(float(value)) for value in row)}," for row in values]
        lines += [f"static const double {name}[] = {{", *rows, "};", ""]
    lines += ["const fb_model floating_block_model = {"]
    lines += [f"  .{name} = {value!s}," for name, value in numbers.items()]
    return "\n".join([*lines, "};", ""])


def _reference_text(block: Block) -> str:
    """Return forces and paths of driftwalk as numbers for ``verify.c``."""
    forces, reference = forces_of(block), reference_of(block)
    lines = [str(len(forces)), *map(_line, forces)]
    sets = (reference.still, reference.noisy)
    lines.append(str(sum(paths.replicate.size for paths in sets)))
    for noisy, paths in enumerate(sets):
        for number, poses in zip(paths.replicate, paths.pose, strict=True):
            lines.append(f"{noisy} {number} {len(poses)} {reference.steps_per_sample}")
            lines += map(_line, poses)
    return "\n".join(lines) + "\n"


def _line(numbers: Floats) -> str:
    return " ".join(repr(float(number)) for number in numbers)


def wall_texts(block: Block, template: str, **more: str) -> str:
    """Return the boxes of the wall, each by a stored text."""
    from string import Template

    # The wall is made of boxes.
    thick = 0.1 * min(block.study.tank.extent_m)
    text = Template(stored_text(template))
    return "".join(
        text.substitute(
            x=repr(piece.middle[0] + piece.normal[0] * thick / 2),
            y=repr(piece.middle[1] + piece.normal[1] * thick / 2),
            angle=repr(piece.angle),
            thick=repr(thick),
            length=repr(piece.length + 2 * thick),
            height=repr(2 * block.study.block.side_m),
            number=str(number),
            **more,
        )
        for number, piece in enumerate(wall_pieces(block.study.tank))
    )


def compiler() -> str:
    """Return a C compiler of this machine, that of the variable CC first.

    Raises
    ------
    InputError
        When there is none; says what to do.
    """
    names = (os.environ.get("CC", ""), "cc", "gcc", "clang")
    found = next((place for name in names if name and (place := shutil.which(name))), None)
    if found is None:
        raise InputError(
            "the proof needs a C compiler: install gcc or clang, or name one in the variable CC"
        )
    return found


def verify_force(folder: Path, sources: str) -> Verification:
    """Compile the force of an export with ``verify.c``, and run it against driftwalk's numbers."""
    found = compiler()
    with tempfile.TemporaryDirectory() as name:
        program = Path(name) / "verify"
        places = [folder / sources / file for file in ("floating_block.c", "model_data.c")]
        command = [found, "-std=c99", "-O2", f"-I{folder / sources}"]
        command += [str(path) for path in (folder / "verify" / "verify.c", *places)]
        built = run_program([*command, "-o", str(program), "-lm"])
        if built.returncode != 0:
            raise InputError(f"{found} does not compile {places[0]}: {last_line(built.stderr)}")
        done = run_program([str(program), str(folder / "verify" / "reference.txt")])
    if done.returncode not in (0, 1):
        raise InputError(f"the proof of {folder} failed: {last_line(done.stderr)}")
    numbers = json.loads(done.stdout)
    lines = (
        f"{numbers['forces']} forces of the compiled code: relative error at most "
        f"{numbers['largest_relative_error']:.2g}",
        f"{numbers['paths']} paths by the compiled code, with and without the stochastic force: "
        f"at most {1e6 * numbers['largest_distance_m']:.2g} µm from driftwalk's"
        if numbers["paths"]
        else NO_PATH,
    )
    return Verification(done.returncode == 0 and numbers["paths"] > 0, lines, numbers)
