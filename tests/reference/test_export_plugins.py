"""The plugins of exports, compiled and stepped without their simulators, against driftwalk's paths.

The plugin for Webots runs in the Open Dynamics Engine, which is the engine of Webots, where it is
installed (Debian: libode-dev). That for Gazebo runs in a stand-in for one link of Gazebo.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from exported import a_compiler, export_of, paths_run_by

HERE = Path(__file__).parent
FARTHEST = 2e-5
"""m, over 10 s: the promise of an export is 0.1 mm, and taken plainly the step is off by 0.5 mm."""
FORCE = ("floating_block.c", "model_data.c")


def built(folder: Path, command: list[str | Path]) -> Path:
    program = folder / "run_plugin"
    subprocess.run([*map(str, command), "-o", str(program), "-lm"], check=True)
    return program


def has_ode(compiler: str) -> bool:
    probe = subprocess.run(
        [compiler, "-x", "c", "-fsyntax-only", "-"],
        input="#include <ode/ode.h>\n", text=True, capture_output=True, check=False,
    )  # fmt: skip
    return probe.returncode == 0


@pytest.mark.parametrize("law", ["paper", "floating"])
def test_the_plugin_for_webots_in_ode(law: str, tmp_path: Path) -> None:
    compiler = a_compiler()
    if not has_ode(compiler):
        pytest.skip("the headers of ODE are not installed (Debian: libode-dev)")
    more = {"forces.pressure_gradient": True, "forces.added_mass_share": 0.3}
    folder = export_of(tmp_path, "webots", **(more if law == "floating" else {}))
    plugin, own = folder / "plugins/physics/driftwalk_water", HERE / "webots_in_ode"
    sources = [own / "run.c", plugin / "driftwalk_water.c", *(plugin / name for name in FORCE)]
    words = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", f"-I{own}", f"-I{plugin}"]
    program = built(tmp_path, [compiler, *words, *sources, "-lode"])
    step = re.search(r"basicTimeStep (\S+)", (folder / "worlds/tank.wbt").read_text())
    assert step is not None
    expected, found = paths_run_by(program, folder, f"{step[1]}ms")
    assert 0 < np.hypot(*(found - expected).T[:2]).max() < FARTHEST


@pytest.mark.slow
def test_the_plugin_for_gazebo_in_a_stand_in(tmp_path: Path) -> None:
    compiler = shutil.which("c++")
    if compiler is None:
        pytest.skip("no C++ compiler")
    folder = export_of(tmp_path, "gazebo")
    own, headers = HERE / "gazebo_stand_in", tmp_path / "headers"
    plugin = (folder / "src/driftwalk_water.cc").read_text()
    for name in re.findall(r"#include <(gz/.+)>", plugin):
        (headers / name).parent.mkdir(parents=True, exist_ok=True)
        (headers / name).write_text('#include "stand_in.hpp"\n')
    places = [f"-I{place}" for place in (headers, own, folder / "src")]
    # C compiled as C++: another compiler's view of the same file.
    sources = ["-x", "c++", own / "run.cc", *(folder / "src" / name for name in FORCE)]
    program = built(tmp_path, [compiler, "-std=c++20", "-O2", "-Wall", *places, *sources])
    step = re.search(r"<max_step_size>(.+)</max_step_size>", (folder / "tank.sdf").read_text())
    assert step is not None
    expected, found = paths_run_by(program, folder, step[1])
    assert 0 < np.hypot(*(found - expected).T[:2]).max() < FARTHEST
