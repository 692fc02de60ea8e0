"""A type checker sees real types: it accepts a right script and finds wrong arguments."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

# The lines on which mypy has to complain carry what it complains about.
SCRIPT = """
import driftwalk as dw

recording = dw.load("track.csv", tank="circle:30cm")
flow = dw.uniform_flow(0.0, 0.01)
study = dw.apply_overrides(dw.Study(), {"forces.force_interval_s": "16ms"})
run = dw.simulate(study, flow, replicates=8)
distance: float = float(dw.compare(recording, run.isel(replicate=0))["ks_distance"])
fit = dw.fit_motion(recording, study)
found = dw.calibrate(recording, study, flow=dw.fitted_flow(fit))
tracker = dw.track.Tracker(dw.track.TrackerSettings(max_speed=0.5, bodies=4))
try:
    dw.describe(recording)
except dw.InputError as error:
    print(error.args)

dw.simulate(study, flow, replicates="eight")  # [arg-type]
dw.simulate(study, flow, replicats=8)  # [call-arg]
dw.load("track.csv", tank_diameter=0.3)  # [call-arg]
dw.calibrate(recording, study, threads=2.5)  # [arg-type]
dw.simulatte(study, flow)  # [attr-defined]
dw.compare(recording)  # [call-arg]
reveal_type(dw.fit_motion)  # fit_motion
"""


@pytest.mark.slow
def test_mypy_sees_the_types_of_a_users_script(tmp_path: Path) -> None:
    pytest.importorskip("mypy", reason="mypy is one of the tools for development")
    script = tmp_path / "script.py"
    script.write_text(SCRIPT, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(tmp_path / "cache"), script],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
    )
    found = {int(line) for line in re.findall(r"script\.py:(\d+): error:", done.stdout)}
    wrong = {
        number
        for number, line in enumerate(SCRIPT.split("\n"), start=1)
        if re.search(r"# \[[a-z-]+\]$", line)
    }
    assert found == wrong, done.stdout + done.stderr
    for number in wrong:
        code = SCRIPT.split("\n")[number - 1].rpartition("# ")[2]
        assert re.search(rf"script\.py:{number}: error:.*{re.escape(code)}", done.stdout), code
    assert "note: Revealed type is" in done.stdout
    assert re.findall(r'Revealed type is "(.*)"', done.stdout)[0] != "Any"
