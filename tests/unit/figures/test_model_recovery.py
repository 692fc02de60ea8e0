"""The figure of a recovery study of a motion model: every error and interval, in its row."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from model_recovery_worlds import lost, made_up, made_up_recovery

from driftwalk.core.errors import InputError
from driftwalk.figures import model_recovery_figures, plot_model_recovery, write_figures


def test_every_error_is_drawn_in_its_row() -> None:
    found = made_up_recovery()
    ax = plot_model_recovery(found)
    points = np.concatenate(
        [np.transpose(line.get_data()) for line in ax.lines if line.get_marker() in ("o", "s")]
    )
    for row in range(3):
        inside = points[np.abs(points[:, 1] - row) < 0.5, 0]
        wanted = 100.0 * found["error"].values[:, row]
        assert np.sort(inside) == pytest.approx(np.sort(wanted))
    assert [text.get_text() for text in ax.get_yticklabels()] == [
        "speed", "rotational diffusion", "turn rate",
    ]  # fmt: skip


def test_what_is_determined_differs_in_form_as_well_as_in_colour() -> None:
    found = made_up_recovery()
    ax = plot_model_recovery(found)
    count = {
        marker: sum(len(line.get_xdata()) for line in ax.lines if line.get_marker() == marker)
        for marker in ("o", "s")
    }
    known = int(found["determined"].sum())
    assert count == {"o": known, "s": found["determined"].size - known}
    assert 0 < known < found["determined"].size


def test_intervals_are_drawn_between_their_ends() -> None:
    found = made_up_recovery(lost(made_up(), 2, 1, "too short"))
    ax = plot_model_recovery(found)
    ends = np.array(
        [
            segment[:, 0]
            for lines in ax.collections
            for segment in lines.get_segments()
            if segment.size
        ]
    )
    ends = ends[np.isfinite(ends).all(axis=1)]
    wanted = 100.0 * found["error_interval"].values.reshape(-1, 2)
    wanted = wanted[np.isfinite(wanted).all(axis=1)]
    order = [np.lexsort(np.transpose(one)) for one in (ends, wanted)]
    assert ends[order[0]] == pytest.approx(wanted[order[1]])


@pytest.mark.slow
def test_it_is_written(tmp_path: Path) -> None:
    alone = lost(made_up(2), 0, 1, "too short")
    for found in (made_up_recovery(), made_up_recovery(alone)):
        written = write_figures(model_recovery_figures(found), tmp_path)
        assert [path.name for path in written] == ["errors.png", "errors.svg"]
    with pytest.raises(InputError, match="expected a dataset 'model_recovery'"):
        plot_model_recovery(xr.Dataset())
