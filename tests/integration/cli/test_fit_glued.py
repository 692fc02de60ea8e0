"""`driftwalk fit DIMER --earlier-fit FIT`: hidden drag, shared stirring, and their use."""

from __future__ import annotations

from pathlib import Path

import pytest
import xarray as xr
from command_line import FLOW, answer, here
from glued_recordings import HIDDEN, LENGTH, RHO, recordings
from made_up_fit import made_up_fit

import driftwalk as dw


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_a_dimer_tells_hidden_drag_and_shared_stirring(tmp_path: Path) -> None:
    one, two = recordings(tmp_path)
    fit, dimer = tmp_path / "fit", tmp_path / "dimer"
    stated = ("--side", "3cm", "--mass", "11.6g", "--force-interval", "10ms")
    answer(here("fit", one, "--tank", "32cm", *stated, "--no-check", "-o", fit, "--json"))
    glued = ("--body-shape", "xx", "--earlier-fit", fit, "--no-check", "--json")
    found = answer(here("fit", two, *glued, "-o", dimer))
    # Twice the interval: what is tested is that the numbers are those of the recording.
    for name, truth in (("hidden_face_drag_share", HIDDEN), ("stirring_correlation", RHO)):
        low, high = found[f"{name}_interval"]
        assert abs(found[name] - truth) < high - low, name
        assert high - low < 0.5
    assert found["stirring_length_m"] == pytest.approx(LENGTH, rel=0.2)
    assert found["stirring_misfit_std"] < 4.0
    few = ("--runs", "40", "--duration", "20s", "--film", "none", "--json")
    predicted = answer(here("assemble", fit, "--earlier-fit", dimer, *few, "-o", tmp_path / "four"))
    assert float(predicted["hidden_face_drag"]) == found["hidden_face_drag_share"]
    assert {"hidden_face_drag_share", "stirring_length"} <= {*predicted["drawn"]["parameters"]}
    again = dw.fit(dw.load(two), body_shape="xx", earlier=fit, check=False)
    share = float(again["estimate"].sel(parameter="hidden_face_drag_share"))
    assert share == found["hidden_face_drag_share"]
    assert again["stirring_length_quantile"].values[[0, -1]] == pytest.approx(LENGTH, rel=0.6)
    refused = here("assemble", dimer, "-o", tmp_path / "five")
    assert refused.code == 2
    assert "squares, discs and rectangles assemble, and the body is 'xx'" in refused.err


@pytest.mark.usefixtures("no_figures")
def test_shares_of_hidden_drag_and_lengths_are_axes(tmp_path: Path) -> None:
    """Words and numbers of the drag on joined faces, in one map with the stirring length (m)."""
    vary = ("--vary", "hidden-face-drag=none,0.5,1", "--vary", "stirring-length=0,6cm")
    study = tmp_path / "study.toml"
    study.write_text("[sensitivity]\nruns = 4\nreference_realisations = 2\n")
    few = ("--study", study, "--blocks", "2", "--duration", "2s", "-o", tmp_path / "map")
    assert here("sensitivity", "--flow", FLOW, *vary, *few).code == 0
    found = xr.open_dataset(tmp_path / "map" / "sensitivity.nc")
    assert list(found["hidden_face_drag"].values) == ["none", "0.5", "1"]
    assert found["stirring_length"].values == pytest.approx([0.0, 0.06])


def test_a_fit_in_memory_does_not_hold_its_recordings() -> None:
    with pytest.raises(dw.InputError, match="in memory does not hold its recordings"):
        dw.fit(dw.tank30_recording(), body_shape="xx", earlier=made_up_fit())


def test_what_cannot_be_glued_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "one.csv"
    path.write_text("t_s,x_m,y_m\n0,0,0\n1,0.01,0\n")
    missing = here("fit", path, "--earlier-fit", tmp_path, "-o", tmp_path / "out")
    assert missing.code == 2
    assert "fit" in missing.err
    for shape, words in (
        ("x.x", "hang together"),
        ("rectangle", "a rectangle has two sides"),
        ("disc:4x2cm", "expected"),
        ("blob", "no body shape 'blob'"),
    ):
        done = here("fit", path, "--tank", "30cm", "--body-shape", shape, "-o", tmp_path / "out")
        assert done.code == 2
        assert words in done.err, (shape, done.err)
        assert len(done.err.strip().splitlines()) == 1
