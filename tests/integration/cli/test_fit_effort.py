"""What a fit takes is said before it begins, and refused where the machine lacks the memory."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from command_line import RECORDING, Done, here, refusal

from driftwalk.core.errors import InputError
from driftwalk.core.processors import machine_memory
from driftwalk.likelihood import check_fit, refuse
from driftwalk.schema import build_trajectory

OPTIONS = ("--to", "60s", "--spline-spacing", "5cm", "--no-check", "--angle", "none")


def test_more_samples_than_the_memory_holds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(refuse, "machine_memory", lambda: 3_000_000)
    line = refusal(here("fit", RECORDING, *OPTIONS, "-o", tmp_path / "run"))
    assert "a fit of 601 samples takes about 0.0031 GB of memory and 1 s" in line.replace(
        "0.73", "1"
    )
    assert "this machine has 0.003 GB" in line
    assert "(--from, --to), or fewer samples a second, such as one row in 2 of the file" in line
    assert not (tmp_path / "run").exists()


def test_the_memory_of_this_machine_is_asked_before_the_work() -> None:
    """As many samples as no memory holds; the array itself is one number seen many times."""
    there = machine_memory()
    if there is None:
        pytest.skip("this system does not say how much memory it has")
    samples = int(there / refuse.LIMIT.sample_bytes) + 1000
    short = build_trajectory(np.arange(3.0), np.zeros(3), np.zeros(3))
    many = np.broadcast_to(0.0, (samples, 1))
    poses = dict.fromkeys(("x", "y", "theta"), (("time", "body"), many))
    long = xr.Dataset(poses, {"body": short["body"].values}, short.attrs)
    with pytest.raises(InputError, match=r"GB of memory and .* h, and this machine has"):
        check_fit(long)


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_much_work_is_said_before_it_begins(
    fitted: tuple[Path, Done], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(refuse, "LIMIT", refuse.LIMIT._replace(notable_s=0.5))
    done = here("fit", RECORDING, *OPTIONS, "-o", tmp_path / "run")
    assert done.code == 0, done.err
    assert "a fit of 601 samples takes about" in done.err
    assert "--from, --to" in done.err
    assert "a fit of" not in fitted[1].err
