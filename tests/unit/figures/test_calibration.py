"""Files of figures: all written, the same each time, and no trace left in matplotlib."""

from __future__ import annotations

import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from synthetic_calibration import bundled_flow, bundled_recording, synthetic_calibration

from driftwalk.core.errors import InputError
from driftwalk.figures import calibration as figures, calibration_figures, write, write_figures
from driftwalk.plot.parts.style import STYLE, print_style
from driftwalk.schema.flow_field import FLAGS

NAMES = [
    "flow",
    "trajectory",
    "steps",
    "ks_map",
    "drag_coefficient_panels",
    "force_std_panels",
    "validation",
]
SVG_LIMIT_BYTES = 1_500_000


@pytest.fixture(scope="module")
def datasets():
    return synthetic_calibration(points=9), bundled_flow(), bundled_recording()


@pytest.fixture(scope="module")
def written(datasets, tmp_path_factory) -> list[Path]:
    calibration, flow, trajectory = datasets
    folder = tmp_path_factory.mktemp("figures") / "made" / "here"
    return write_figures(calibration_figures(calibration, trajectory, flow), folder)


@pytest.mark.slow
def test_every_figure_is_written_in_every_format(written) -> None:
    assert [path.name for path in written] == [
        f"{name}.{suffix}" for name in NAMES for suffix in ("png", "svg")
    ]
    for path in written:
        assert 10_000 < path.stat().st_size < SVG_LIMIT_BYTES


@pytest.mark.slow
def test_svg_is_well_formed_and_as_wide_as_a_column(written) -> None:
    for path in written:
        if path.suffix == ".svg":
            root = ET.fromstring(path.read_text(encoding="utf-8"))
            width_mm = float(root.attrib["width"].removesuffix("pt")) / 72 * 25.4
            assert width_mm in (pytest.approx(90.0), pytest.approx(180.0))
            assert "<dc:date>" not in path.read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_same_datasets_give_the_same_bytes(written, datasets, tmp_path) -> None:
    calibration, flow, trajectory = datasets
    table = calibration_figures(calibration, trajectory, flow)
    some = {name: table[name] for name in ("flow", "ks_map", "validation")}
    first = {path.name: path.read_bytes() for path in written}
    for path in write_figures(some, tmp_path, ["svg"]):
        assert path.read_bytes() == first[path.name], path.name


@pytest.mark.slow
def test_fonts_of_a_pdf_are_truetype(datasets, tmp_path) -> None:
    calibration, flow, trajectory = datasets
    table = calibration_figures(calibration, trajectory, flow)
    for path in write_figures({"ks_map": table["ks_map"]}, tmp_path, ["pdf"]):
        content = path.read_bytes()
        assert b"/Type3" not in content
        assert b"/FontFile2" in content


def test_style_is_restored_even_after_an_error() -> None:
    before = dict(matplotlib.rcParams)

    def fail() -> None:
        with print_style():
            assert matplotlib.rcParams["font.size"] == STYLE["font.size"]
            raise InputError("stop")

    with pytest.raises(InputError, match="stop"):
        fail()
    assert dict(matplotlib.rcParams) == before


@pytest.mark.slow
def test_importing_is_light_and_drawing_needs_no_pyplot() -> None:
    code = (
        "import sys, driftwalk.plot as plot\n"
        "assert 'matplotlib' not in sys.modules\n"
        "plot.steps([0.001, 0.002], [0.0, 0.1])\n"
        "assert 'matplotlib.pyplot' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def _texts(figure) -> list[str]:
    return [text.get_text() for text in figure.findobj(matplotlib.text.Text)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("simulated", "expected"), [("yes", 1), pytest.param("no", 0, marks=pytest.mark.slow)]
)
def test_a_simulated_recording_is_named_so(
    datasets, tmp_path, monkeypatch, simulated, expected
) -> None:
    calibration, flow, trajectory = datasets
    changed = calibration.assign_attrs(simulated_recording=simulated)
    seen: list[int] = []

    def count(figure, stem, formats):
        seen.append(sum("simulated recording, not measured" in text for text in _texts(figure)))
        return []

    monkeypatch.setattr(write, "_save", count)
    write_figures(calibration_figures(changed, trajectory, flow), tmp_path)
    assert seen == [expected] * len(NAMES)


@pytest.mark.slow
def test_both_panels_of_the_flow_share_one_scale(datasets) -> None:
    figure = figures.flow_figure(datasets[1])
    block, water = figure.axes[:2]
    assert block.collections[0].get_clim() == water.collections[0].get_clim()
    assert "hatched: filled" in water.get_title(loc="left")
    flow = datasets[1]
    measured = flow["flag"].values == FLAGS["measured"]
    speeds = (np.hypot(flow[f"u{of}"], flow[f"v{of}"]).values[measured] for of in ("", "_block"))
    fastest = max(map(np.max, speeds))
    assert water.collections[0].get_clim()[1] == pytest.approx(100 * fastest)


@pytest.mark.slow
def test_an_analytic_flow_has_one_panel(datasets) -> None:
    figure = figures.flow_figure(datasets[1].drop_vars(["u_block", "v_block"]))
    assert len(figure.axes) == 2


def test_without_refinement_the_map_stands_alone(datasets) -> None:
    coarse = datasets[0].drop_vars(["refined_ks_distance", "refined_surface"])
    figure = figures.ks_map_figure(coarse)
    assert len(figure.axes) == 2
    assert figure.axes[0].get_legend() is not None


def test_a_short_recording_is_drawn_whole() -> None:
    figure = figures.trajectory_figure(bundled_recording(rows=100))
    assert figure.axes[0].get_title(loc="left") == ""
    figure = figures.trajectory_figure(bundled_recording())
    assert figure.axes[0].get_title(loc="left") == "first 60 s of 1800 s"


@pytest.mark.slow
def test_every_text_lies_inside_its_figure(datasets) -> None:
    calibration, flow, trajectory = datasets
    with print_style():
        for figure in (
            figures.flow_figure(flow),
            figures.trajectory_figure(trajectory),
            figures.ks_map_figure(calibration),
            figures.panels_figure(calibration, "force_std"),
            figures.validation_figure(calibration),
        ):
            figure.draw_without_rendering()
            for ax in figure.axes:
                for text in (ax.title, ax._left_title, ax.xaxis.label, ax.yaxis.label):
                    box = text.get_window_extent()
                    if text.get_text():
                        assert box.x0 >= -0.5, text
                        assert box.y0 >= -0.5, text
                        assert box.x1 <= figure.bbox.x1 + 0.5, text
                        assert box.y1 <= figure.bbox.y1 + 0.5, text


def test_an_unknown_format_is_refused_before_anything_is_written(datasets, tmp_path) -> None:
    calibration, flow, trajectory = datasets
    with pytest.raises(InputError, match="as gif: choose from png, svg, pdf"):
        write_figures(calibration_figures(calibration, trajectory, flow), tmp_path / "x", ["gif"])
    assert not (tmp_path / "x").exists()


@pytest.mark.slow
def test_without_bootstrap_the_profiles_are_drawn_alone(datasets, tmp_path, monkeypatch) -> None:
    calibration, flow, trajectory = datasets
    names = [name for name in calibration if name.startswith(("bootstrap_", "region_"))]
    assert "bootstrap_drag_coefficient" in names
    bare = calibration.drop_vars(names)
    with print_style():
        figure = figures.validation_figure(bare)
    assert len(figure.axes) == 2
    with print_style():
        full = figures.validation_figure(calibration)
    for alone, beside in zip(figure.axes, full.axes, strict=False):
        assert len(alone.lines) == len(beside.lines) > 0
        for one, other in zip(alone.lines, beside.lines, strict=True):
            np.testing.assert_array_equal(one.get_xydata(), other.get_xydata())
    made: list[str] = []
    monkeypatch.setattr(write, "_save", lambda figure, stem, formats: made.append(stem.name) or [])
    write_figures(calibration_figures(bare, trajectory, flow), tmp_path, ["png"])
    assert made == NAMES
