"""`driftwalk fit TWO --interaction`: the length over which two free bodies share the stirring."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from command_line import answer, here
from euler_blocks import euler_recordings, stirred

import driftwalk as dw
from driftwalk.figures import fit_figures
from driftwalk.model import parse_study
from driftwalk.page.sections.fit import fit_sections

LENGTH = 0.1
STATED = ("--tank", "32cm", "--side", "3cm", "--mass", "11.6g", "--depth", "immersed")


def recorded(folder: Path, length: float, seconds: float) -> Path:
    """Write a recording of two blocks as a tracker does, a row for each body and frame."""
    (found,) = euler_recordings(
        lambda x, y, _: stirred(x, y), worlds=1, seconds=seconds, seed=12, stirring_length=length
    )
    path = folder / "two-blocks.csv"
    rows = [
        [np.broadcast_to(found["time"].values[:, None], (found.sizes["time"], 2)).ravel()],
        [np.tile([1.0, 2.0], found.sizes["time"])],
        *([found[name].values.ravel()] for name in ("x", "y", "theta")),
    ]
    np.savetxt(path, np.concatenate(rows).T, delimiter=",", comments="",
               header="t_s,body,x_m,y_m,theta_rad", fmt=["%.1f", "%d", *["%.6f"] * 3])  # fmt: skip
    return path


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_two_free_blocks_tell_the_length_of_the_stirring(tmp_path: Path) -> None:
    """Twice the 90 % interval, which chance leaves once in a thousand recordings."""
    path, fit = recorded(tmp_path, LENGTH, 300.0), tmp_path / "fit"
    stated = (*STATED, "--force-interval", "10ms", "--spline-spacing", "3cm")
    found = answer(here("fit", path, *stated, "--interaction", "--no-check", "-o", fit, "--json"))
    low, high = found["stirring_length_m_interval"]
    assert abs(found["stirring_length_m"] - LENGTH) < high - low < 0.5 * LENGTH
    assert found["stirring_misfit_std"] < 4.0
    assert found["recording"] == "two-blocks.csv (1), two-blocks.csv (2)"
    few = ("--runs", "8", "--duration", "5s", "--film", "none", "--json")
    done = here("assemble", fit, "--earlier-fit", fit, *few, "-o", tmp_path / "four")
    assert done.code == 0
    assert f"length of the stirring {found['stirring_length_m']:.2g}" in done.err
    length = parse_study(xr.open_dataset(tmp_path / "four" / "assembly.nc").attrs["study"])
    assert length.forces.stirring_length_m == found["stirring_length_m"]


@pytest.mark.slow
def test_independent_forces_have_no_length(tmp_path: Path) -> None:
    """In Python; and their picture and chart."""
    path = recorded(tmp_path, 0.0, 200.0)
    recording = dw.load(path, tank="circle:32cm", block="3cm")
    settings = {"mass": "11.6g", "depth": "immersed", "spline_spacing": "3cm"}
    fit = dw.fit(recording, interaction=True, check=False, **settings)
    number = {"parameter": "stirring_length"}
    assert float(fit["estimate"].sel(number)) == 0.0
    assert fit["interval"].sel(number).values[0] == 0.0
    assert any("cannot tell a length of the stirring" in str(one) for one in fit["warning"].values)
    assert "stirring" in fit_figures(fit, recording, flows=[])
    (chart,) = (part for part in fit_sections(fit) if part["id"] == "stirring")
    assert chart["x"]["unit"] == "m"
    # Measured correlations are those of independent forces, to four standard deviations.
    width = np.diff(fit["force_correlation_interval"].values, axis=1)[:, 0]
    assert (np.abs(fit["force_correlation"].values) < 4.0 / 3.29 * width).all()


def test_an_interaction_of_one_body_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "one.csv"
    path.write_text("t_s,x_m,y_m\n0,0,0\n1,0.01,0\n2,0.02,0.01\n")
    done = here("fit", path, "--tank", "30cm", "--interaction", "-o", tmp_path / "out")
    assert done.code == 2
    assert "2 to 8 bodies can be compared, and the recording has 1: leave out --interaction" in (
        done.err
    )
    assert len(done.err.strip().splitlines()) == 1
