"""Blocks in the tank: corners, colours, strips and films."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from matplotlib.animation import FFMpegWriter, PillowWriter
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_hex
from matplotlib.patches import Circle
from PIL import Image
from synthetic_assembly import assembly_end, assembly_path

from driftwalk.core.errors import InputError
from driftwalk.plot.parts.assembly_labels import PALETTE
from driftwalk.plot.tank import (
    FRAMES_PER_S,
    block_corners,
    plot_blocks,
    plot_film_strip,
    write_animation,
)


@pytest.fixture(scope="module")
def path():
    return assembly_path()


def squares(ax) -> PolyCollection:
    return next(artist for artist in ax.collections if isinstance(artist, PolyCollection))


def centers(ax) -> np.ndarray:
    return np.array([outline.vertices[:4].mean(axis=0) for outline in squares(ax).get_paths()])


def test_corners_are_turned_about_the_middle_by_complex_numbers(path) -> None:
    corners = block_corners(path)
    assert corners.shape == (2, 301, 4, 4, 2)
    middle = 100 * (path["x"].values + 1j * path["y"].values)
    own = 1.5 * np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j])
    expected = middle[..., None] + np.exp(1j * path["theta"].values)[..., None] * own
    np.testing.assert_allclose(corners[..., 0] + 1j * corners[..., 1], expected, atol=1e-9)


def test_order_of_the_dimensions_does_not_matter(path) -> None:
    turned = path.transpose("block", "time", "run")
    one, other = (centers(plot_blocks(data, run=1, time=90.0)) for data in (path, turned))
    np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(("time", "sample"), [(0.0, 0), (99.9, 99), (100.0, 100), (None, 300)])
def test_the_last_sample_up_to_the_moment_is_drawn(path, time, sample) -> None:
    ax = plot_blocks(path, run=1, time=time)
    expected = 100 * np.column_stack([path[name].values[1, sample] for name in "xy"])
    np.testing.assert_allclose(centers(ax), expected, atol=1e-9)
    assert ax.get_title(loc="left") == f"t = {sample} s"


def test_blocks_of_one_assembly_have_one_colour(path) -> None:
    ax = plot_blocks(path, time=100.0)
    colors = [to_hex(color, keep_alpha=False).upper() for color in squares(ax).get_facecolor()]
    labels = path["assembly"].values[0, 100]
    assert labels.tolist() == [0, 0, 2, 3]
    assert colors == [PALETTE[label].upper() for label in labels]


def test_wall_of_the_tank_is_drawn_in_cm(path) -> None:
    (wall,) = [p for p in plot_blocks(path).patches if isinstance(p, Circle)]
    assert wall.get_radius() == pytest.approx(15.0)


def test_end_of_the_runs_is_drawn_from_an_assembly_dataset(path) -> None:
    ax = plot_blocks(assembly_end(path), run=1)
    np.testing.assert_allclose(centers(ax), centers(plot_blocks(path, run=1)))
    with pytest.raises(InputError, match="leave out time"):
        plot_blocks(assembly_end(path), time=3.0)


def test_strip_shows_equally_spaced_moments(path) -> None:
    panels = plot_film_strip(path, run=1, count=7)
    assert [ax.get_title(loc="left") for ax in panels] == [
        f"t = {time} s" for time in (0, 50, 100, 150, 200, 250, 300)
    ]
    for ax, sample in zip(panels, range(0, 301, 50), strict=True):
        expected = 100 * np.column_stack([path[name].values[1, sample] for name in "xy"])
        np.testing.assert_allclose(centers(ax), expected, atol=1e-9)


def test_what_cannot_be_drawn_is_refused(path) -> None:
    for wrong, message in (
        (lambda: plot_blocks(path, run=2), "run=2: the dataset has 2 runs"),
        (lambda: plot_blocks(path, time=301.0), "lasts from 0 s to 300 s"),
        (lambda: plot_blocks(path.assign_attrs(kind="trajectory")), "got 'trajectory'"),
        (lambda: plot_blocks(path.drop_vars("theta")), "lacks theta"),
        (lambda: plot_film_strip(assembly_end(path)), "kind 'assembly_path', got 'assembly'"),
        (lambda: plot_film_strip(path, count=1), "at least 2 moments"),
        (lambda: plot_film_strip(path, [1], count=2), "got 1 axes, expected 2"),
        (lambda: write_animation(path, "run.avi"), "that ends in .gif or .mp4"),
        (lambda: write_animation(path, "run.gif", seconds=0.0), "at least 0.2 s"),
    ):
        with pytest.raises(InputError, match=message):
            wrong()
    bare = path.copy()
    del bare.attrs["block_side_m"]
    with pytest.raises(InputError, match="block_side_m"):
        plot_blocks(bare)


def pixels(frame: Image.Image, color: str) -> np.ndarray:
    """Return where a frame has about this colour."""
    wanted = np.array([int(color[i : i + 2], 16) for i in (1, 3, 5)])
    return np.argwhere(
        np.abs(np.asarray(frame.convert("RGB"), dtype=int) - wanted).max(axis=2) < 12
    )


def test_gif_has_its_frames_and_shows_the_blocks_where_they_are(path, tmp_path) -> None:
    file = write_animation(path, tmp_path / "run.gif", seconds=2.0)
    with Image.open(file) as film:
        assert film.n_frames == round(2.0 * FRAMES_PER_S)
        assert film.info["duration"] == 80
        assert film.size == (400, 400)
        for frame, time in ((0, 0.0), (24, 300.0)):
            film.seek(frame)
            seen = pixels(film, PALETTE[0])
            sample = round(time)
            blue = path["assembly"].values[0, sample] == 0
            x, y = (100 * path[name].values[0, sample, blue].mean() for name in "xy")
            # 400 pixels; axes over 94 and 90 % of them; the tank of 30 cm and a margin of 3 %.
            per_cm = 0.9 * 400 / (30 * 1.06)
            assert seen.mean(axis=0)[1] == pytest.approx(200 + per_cm * x, abs=2.0)
            assert seen.mean(axis=0)[0] == pytest.approx(400 * (1 - 0.48) - per_cm * y, abs=2.0)
            area = blue.sum() * (3.0 * per_cm) ** 2
            assert 0.8 * area < len(seen) < 1.02 * area


def test_a_film_is_whole_or_not_there(path, tmp_path, monkeypatch) -> None:
    with pytest.raises(InputError, match=r"the folder .*nowhere does not exist"):
        write_animation(path, tmp_path / "nowhere" / "run.gif", seconds=0.2)

    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(PillowWriter, "finish", stop)
    with pytest.raises(KeyboardInterrupt):
        write_animation(path, tmp_path / "run.gif", seconds=0.2)
    assert list(tmp_path.iterdir()) == []


def test_without_ffmpeg_an_mp4_is_refused_and_says_what_to_do(path, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(FFMpegWriter, "isAvailable", classmethod(lambda cls: False))
    with pytest.raises(InputError, match=r"needs the program ffmpeg.*write a \.gif"):
        write_animation(path, tmp_path / "run.mp4")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="ffmpeg is not installed")
def test_mp4_lasts_as_long_as_asked(path, tmp_path: Path) -> None:
    file = write_animation(path, tmp_path / "run.mp4", seconds=2.0)
    told = subprocess.run(["ffmpeg", "-i", str(file)], capture_output=True, text=True, check=False)
    assert "Duration: 00:00:02.00" in told.stderr
    assert "400x400" in told.stderr


@pytest.mark.slow
def test_a_run_of_five_minutes_gives_a_small_file(path, tmp_path) -> None:
    assert write_animation(path, tmp_path / "run.gif").stat().st_size < 3_000_000
