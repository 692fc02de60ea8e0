"""Figure of a path in the tank."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.collections import LineCollection
from synthetic_calibration import ARENA, bundled_recording

from driftwalk.core.errors import InputError
from driftwalk.plot import trajectory as plot_trajectory
from driftwalk.schema import build_trajectory


def _path(ax) -> LineCollection:
    return next(artist for artist in ax.collections if isinstance(artist, LineCollection))


def test_path_is_in_cm_and_coloured_by_time() -> None:
    recording = bundled_recording(rows=50)
    path = _path(plot_trajectory(recording))
    segments = np.array(path.get_segments())
    np.testing.assert_allclose(segments[:, 0, 0], 100 * recording["x"].values[:-1, 0])
    np.testing.assert_allclose(segments[:, 1, 1], 100 * recording["y"].values[1:, 0])
    np.testing.assert_allclose(path.get_array(), recording["time"].values[:-1])


def test_gaps_are_not_bridged() -> None:
    time = np.array([0.0, 0.1, 0.2, 0.5, 0.6, 0.7, 0.8])
    x = np.array([0.0, 0.01, 0.02, 0.03, np.nan, 0.05, 0.06])
    path = _path(plot_trajectory(build_trajectory(time, x, np.zeros(7))))
    starts = np.array(path.get_segments())[:, 0, 0]
    np.testing.assert_allclose(starts, [0.0, 1.0, 5.0])


def test_excerpt_takes_both_ends() -> None:
    recording = bundled_recording(rows=50)
    ax = plot_trajectory(recording, start=1.0, stop=2.0)
    path = _path(ax)
    assert len(path.get_segments()) == 10
    assert path.get_clim() == (1.0, 2.0)
    (start,) = [line for line in ax.lines if line.get_label() == "start"]
    assert start.get_xdata()[0] == pytest.approx(100 * recording["x"].values[10, 0])


def test_outline_aspect_and_labels() -> None:
    ax = plot_trajectory(bundled_recording(rows=50))
    assert ax.get_aspect() == 1.0
    assert ax.patches[0].radius == pytest.approx(15.0)
    assert ax.get_xlabel() == "x (cm)"
    assert ax.figure.axes[1].get_ylabel() == "time (s)"


def test_without_an_arena_the_path_sets_the_frame() -> None:
    ax = plot_trajectory(build_trajectory([0, 0.1, 0.2], [0, 0.1, 0.2], [0, 0.1, 0.0]))
    assert not ax.patches
    assert ax.get_xlim()[0] <= 0.0
    assert ax.get_xlim()[1] >= 20.0


def test_a_body_is_chosen_by_name() -> None:
    columns = np.array([[0.0, 0.1], [0.01, 0.11], [0.02, 0.12]])
    both = build_trajectory([0, 0.1, 0.2], columns, columns, body=["a", "b"])
    assert _path(plot_trajectory(both, body="b")).get_segments()[0][0, 0] == pytest.approx(10.0)
    with pytest.raises(InputError, match="2 bodies"):
        plot_trajectory(both)


def test_an_empty_excerpt_is_refused() -> None:
    with pytest.raises(InputError, match=r"seen from 0 s to 4\.9 s"):
        plot_trajectory(bundled_recording(rows=50), start=100.0)


def test_a_body_never_seen_is_refused() -> None:
    lost = build_trajectory([0, 1], [np.nan, np.nan], [0, 0], attrs={"arena": ARENA})
    with pytest.raises(InputError, match="never seen"):
        plot_trajectory(lost)


def test_a_long_path_is_stored_as_a_picture_in_vector_files() -> None:
    assert _path(plot_trajectory(bundled_recording())).get_rasterized()
    assert not _path(plot_trajectory(bundled_recording(rows=50))).get_rasterized()
