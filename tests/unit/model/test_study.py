"""The study: defaults, round trip, template, refusals, overrides."""

from __future__ import annotations

import inspect
import tomllib
from pathlib import Path

import pytest

import driftwalk
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.model import (
    Study,
    Tank,
    apply_overrides,
    load_study,
    parameter_table,
    parse_study,
    short_study_template,
    study_template,
)
from driftwalk.model.section import Section, description_of, quantity_of
from driftwalk.record import load

DOCS = Path(__file__).parents[3] / "docs"


def test_defaults_are_the_papers_block_and_tank() -> None:
    study = Study()
    assert (study.block.side_m, study.block.mass_kg, study.tank.diameter_m) == (0.03, 0.0116, 0.30)
    assert study.block.inertia_kg_m2 == pytest.approx(0.0116 * 0.03**2 / 6)
    assert study.wetted_depth_m == 0.03
    assert study.time_step_s == 0.010
    assert study.forces.force_noise_intensity_N2_s == pytest.approx(0.55e-3**2 * 0.010)


def test_template_loads_as_the_default_study(tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    path.write_text(study_template(), encoding="utf-8")
    assert load_study(path) == Study()


def test_template_names_every_parameter() -> None:
    lines = study_template().splitlines()
    for name in Study.model_fields:
        assert f"[{name}]" in lines
        for key in type(getattr(Study(), name)).model_fields:
            assert any(line.removeprefix("# ").startswith(f"{key} = ") for line in lines), key


def test_template_keeps_the_values_of_a_study() -> None:
    study = apply_overrides(Study(), {"tank.diameter_m": 0.5, "block.depth_m": 0.0129})
    assert parse_study(study_template(study)) == study


def test_examples_of_the_template_can_be_uncommented() -> None:
    """Each line "# key = value" of a parameter that is not set is a value that TOML reads."""
    section, found = "", 0
    for line in study_template().splitlines():
        if line.startswith("["):
            section = line.strip("[]")
        key, equals, _ = line.removeprefix("# ").partition(" = ")
        if line.startswith("# ") and equals and section and key in _fields(section):
            values = tomllib.loads(line.removeprefix("# "))
            study = Study(**{section: {**_companions(section, key), **values}})
            assert getattr(getattr(study, section), key) is not None
            found += 1
    assert found >= 15


def _fields(section: str) -> dict[str, object]:
    return dict(type(getattr(Study(), section)).model_fields)


def _companions(section: str, key: str) -> dict[str, object]:
    """The keys that a key of a rectangle, a polygon or a list of intervals needs beside it."""
    if section == "block":
        return {"shape": "rectangle"} if key == "width_m" else {}
    return {
        "flow_labels": {"switching_times_s": [600.0, 1200.0]},
        "width_m": {"shape": "rectangle", "height_m": 0.3},
        "height_m": {"shape": "rectangle", "width_m": 0.3},
        "vertices_m": {"shape": "polygon"},
    }.get(key, {})


def test_every_number_declares_a_unit_that_its_name_repeats() -> None:
    suffixes = {"m", "kg", "s", "N", "rad", "Hz", "m_s", "kg_m3", "kg_s", "Pa_s", "N_m", "N_s"}
    suffixes |= {"per_s"}
    for name in Study.model_fields:
        kind = type(getattr(Study(), name))
        for key in kind.model_fields:
            assert description_of(kind, key), key
            quantity = quantity_of(kind, key)
            if quantity is not None and quantity.unit != "1" and key != "metres_per_pixel":
                suffix = quantity.unit.replace("1/", "per_").replace("/", "_").replace(" ", "_")
                assert suffix in suffixes
                assert key.endswith(f"_{suffix}"), key


def test_truth_values_survive_the_file_and_nothing_else_is_one() -> None:
    for wanted in (True, False):
        study = Study(forces={"pressure_gradient": wanted})
        assert f"pressure_gradient = {str(wanted).lower()}" in study.to_toml()
        assert parse_study(study.to_toml()) == study
        assert parse_study(study_template(study)) == study
    with pytest.raises(
        ConfigurationError, match=r"\[forces\] pressure_gradient must be true or false, got 'maybe'"
    ):
        parse_study('[forces]\npressure_gradient = "maybe"\n')


@pytest.mark.parametrize(
    ("key", "value", "sentence"),
    [
        ("added_mass_share", 5.1, "must be at most 5, got 5.1"),
        ("added_mass_share", -0.1, "must be at least 0, got -0.1"),
        ("linear_drag_kg_s", -1e-6, "must be at least 0 kg/s, got -1e-06"),
        ("force_memory_s", "-1ms", "must be at least 0 s, got -1ms"),
    ],
)
def test_a_force_law_beyond_its_bounds_is_refused(key: str, value: object, sentence: str) -> None:
    with pytest.raises(ConfigurationError, match=rf"\[forces\] {key}: {sentence}"):
        Study(forces={key: value})


def test_study_is_frozen_and_hashable() -> None:
    study = Study()
    with pytest.raises(ValueError, match="frozen"):
        study.block = study.block  # type: ignore[misc]
    assert hash(study) == hash(Study())


def test_text_with_units_is_read() -> None:
    study = parse_study(
        '[tank]\ndiameter_m = "30cm"\n[forces]\nforce_std_N = "0.55mN"\nforce_interval_s = "16ms"\n'
        '[observation]\norientation_noise_rad = "0.5deg"\nposition_noise_m = "0.3mm"\n'
        '[block]\nmass_kg = "11.6g"\n[water]\ndensity_kg_m3 = "1g/cm3"\n[simulation]\n'
        'duration_s = "30min"\n'
    )
    assert study.tank.diameter_m == 0.30
    assert study.forces.force_std_N == 0.00055
    assert study.time_step_s == 0.008
    assert study.observation.position_noise_m == 0.0003
    assert study.block.mass_kg == 0.0116
    assert study.water.density_kg_m3 == 1000.0
    assert study.simulation.duration_s == 1800.0


@pytest.mark.parametrize(
    ("interval", "step"),
    [(0.016, 0.008), (0.010, 0.010), (0.005, 0.005), (0.03, 0.01), (0.025, 0.025 / 3), (1, 0.01)],
)
def test_automatic_time_step_is_the_largest_divisor_up_to_ten_milliseconds(
    interval: float, step: float
) -> None:
    assert Study(forces={"force_interval_s": interval}).time_step_s == pytest.approx(
        step, rel=1e-12
    )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[tank]\ndiametre_m = 1", "[tank] unknown key 'diametre_m'; did you mean 'diameter_m'?"),
        ("[block]\nside = 1", "[block] unknown key 'side'; did you mean 'side_m'?"),
        ("[tnak]\ndiameter_m = 1", "unknown section or key 'tnak'; did you mean 'tank'?"),
        ("zzz = 1", "unknown section or key 'zzz'"),
        ("tank = 3", "[tank] must be a section of keys, got 3"),
        ("[tank]\ndiameter_m = -1", "[tank] diameter_m: must be more than 0 m, got -1"),
        ('[tank]\ndiameter_m = "5s"', "[tank] diameter_m: expected a number in m"),
        ("[tank]\ndiameter_m = nan", "which is not finite"),
        ("[tank]\ndiameter_m = true", "[tank] diameter_m: expected a number in m"),
        ("[tank]\ndiameter_m = [1]", "[tank] diameter_m: expected a number in m"),
        ("[tank]\nwall_restitution = 1.5", "wall_restitution: must be at most 1, got 1.5"),
        ("[tank]\nwall_friction = -1", "wall_friction: must be at least 0, got -1"),
        ("[calibration]\nconfidence = 1.0", "confidence: must be less than 1, got 1.0"),
        ("[block]\nmass_kg = -1", "[block] mass_kg: must be more than 0 kg, got -1"),
        ("[block]\nstrips_per_face = 65", "strips_per_face: must be at most 64, got 65"),
        ("[block]\nside_m = 0.5", "[block] side_m = 0.5 (diagonal 0.707 m)"),
        (
            '[block]\ndepth = "archimedes"\ndepth_m = 0.02',
            "depth = 'archimedes' and depth_m = 0.02 both given",
        ),
        (
            '[block]\ndepth = "deep"',
            '[block] depth must be "immersed" or "archimedes", got \'deep\'',
        ),
        (
            "[simulation]\ntime_step_s = 0.003",
            "time_step_s = 0.003 does not divide force_interval_s = 0.01",
        ),
        ("[simulation]\ntime_step_s = 0.02", "time_step_s = 0.02 does not divide"),
        ("[simulation]\nseed = 1.5", "[simulation] seed: expected a whole number, got 1.5"),
        ("[simulation]\nreplicates = 0", "replicates: must be at least 1, got 0"),
        ('[simulation]\nstart = "centre"', 'start: expected "random" or a pose'),
        (
            "[simulation]\nstart = { x = 1 }",
            "[simulation.start] unknown key 'x'; did you mean 'x_m'?",
        ),
        ("[simulation]\nstart = { x_m = 0.14 }", "outside [tank], a circle of diameter 0.3 m"),
        ('[flow]\ninertia = "corected"', "got 'corected'; did you mean 'corrected'?"),
        (
            '[observation]\nposition_noise_m = "guess"',
            "position_noise_m: expected a number in m or \"estimate\", got 'guess'",
        ),
        (
            '[observation]\nfield_of_view = { shape = "rectangle" }',
            '[observation.field_of_view] shape = "rectangle" needs width_m',
        ),
        (
            "[calibration]\ndrag_coefficient_min = 1\ndrag_coefficient_max = 0.5",
            "the grid has no setting: drag_coefficient_max = 0.5 is below drag_coefficient_min = 1",
        ),
        ("[calibration]\nforce_std_step_N = 0", "force_std_step_N: must be more than 0 N, got 0"),
        ("[calibration]\nforce_std_step_N = 1e-12", "more than 1000000 values"),
        (
            "[calibration]\nforce_std_step_N = 1e-6\ndrag_coefficient_step = 1e-3",
            "2001 x 2001 = 4004001 settings",
        ),
        ("[recording]\nstart_s = 5\nstop_s = 3", "stop_s = 3 is not after start_s = 5"),
        ("[recording]\ncolumns = { v = 1 }", "[recording.columns] unknown key 'v'"),
        ("[tank\n", "not a TOML file"),
        ("[tank]\n[tank]\n", "not a TOML file"),
        ("[block]\nmass_kg = 0\n[tank]\nwall_friction = -1", "(and 1 more problem)"),
    ],
)
def test_refusal_names_file_section_key_and_both_facts(
    tmp_path: Path, text: str, words: str
) -> None:
    path = tmp_path / "study.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigurationError) as caught:
        load_study(path)
    assert words in str(caught.value)
    assert str(path) in str(caught.value)
    assert "pydantic" not in str(caught.value)


def test_sections_built_in_python_refuse_in_the_same_words() -> None:
    with pytest.raises(InputError, match=r"\[block\] mass_kg: must be more than 0 kg, got -1"):
        Study(block={"mass_kg": -1})
    kind: type[Section] = type(Study().block)
    with pytest.raises(InputError, match=r"\[block\] mass_kg: must be more than 0 kg, got -1"):
        kind(mass_kg=-1)


def test_file_that_is_not_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    path.write_bytes(b"\xff\xfe[\x00t\x00")
    with pytest.raises(ConfigurationError, match="not a text file in UTF-8"):
        load_study(path)


def test_byte_order_mark_is_accepted(tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    path.write_bytes("[tank]\ndiameter_m = 0.4\n".encode("utf-8-sig"))
    assert load_study(path).tank.diameter_m == 0.4


def test_missing_file_is_an_operating_system_error(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        load_study(tmp_path / "none.toml")


def test_overrides_replace_one_value_and_leave_the_study() -> None:
    study = Study()
    changed = apply_overrides(study, {"tank.diameter_m": 0.5, "simulation.seed": 7})
    assert (changed.tank.diameter_m, changed.simulation.seed) == (0.5, 7)
    assert study == Study()
    assert apply_overrides(changed, {"tank.diameter_m": None, "simulation.seed": None}) == study


def test_overrides_replace_what_contradicts_them() -> None:
    rectangle = apply_overrides(
        Study(), {"tank.shape": "rectangle", "tank.width_m": 0.4, "tank.height_m": 0.2}
    )
    assert rectangle.tank.extent_m == (0.4, 0.2)
    assert apply_overrides(rectangle, {"tank.width_m": 0.5}).tank.extent_m == (0.5, 0.2)
    assert apply_overrides(rectangle, {"tank.diameter_m": 0.3}) == Study()
    shallow = apply_overrides(Study(), {"block.depth_m": "2cm"})
    assert shallow.wetted_depth_m == 0.02
    assert apply_overrides(shallow, {"block.depth": "archimedes"}).wetted_depth_m == pytest.approx(
        0.0116 / (1000 * 0.03**2)
    )


@pytest.mark.parametrize("name", ["tnak.diameter_m", "tank", "diameter_m", "tank.diametre_m", ".x"])
def test_override_of_nothing_is_refused(name: str) -> None:
    with pytest.raises(ConfigurationError, match=r"no parameter|unknown key"):
        apply_overrides(Study(), {name: 1})


PAGE = Path(__file__).resolve().parents[3] / "docs" / "reference" / "study-file.md"


@pytest.mark.parametrize("name", list(Study.model_fields))
def test_reference_page_has_the_table_of_the_declarations(name: str) -> None:
    table = parameter_table(name)
    assert f"## [{name}]\n\n{description_of(Study, name)}\n\n{table}\n" in PAGE.read_text(
        encoding="utf-8"
    ), f"paste the output of driftwalk.model.parameter_table({name!r}) under [{name}]"


def test_example_of_the_reference_page_is_a_study() -> None:
    example = PAGE.read_text(encoding="utf-8").partition("```toml\n")[2].partition("```")[0]
    assert parse_study(example).recording.arena == "fit"


def test_load_options_are_arguments_of_load() -> None:
    study = Study(
        recording={
            "format": "table",
            "start_s": 1,
            "stop_s": 2,
            "frame_rate_Hz": 25,
            "metres_per_pixel": "0.5mm",
            "length_unit": "px",
            "y_axis": "down",
            "columns": {"x": 2, "y": "pos_y:mm"},
            "sort": "sort",
            "x_file": "x.csv",
            "arena_center_m": [0.1, -0.2],
        }
    )
    options = study.load_options()
    assert options["columns"] == {"x": "2", "y": "pos_y:mm"}
    assert options["metres_per_pixel"] == 0.0005
    assert options["tank"] == "circle:0.3@0.1,-0.2"
    assert options.keys() <= inspect.signature(load).parameters.keys()
    assert Study().load_options() == {"sort": "error", "tank": "circle:0.3"}


@pytest.mark.parametrize(
    ("values", "arena"),
    [
        ({"recording": {"arena": "fit"}}, "fit"),
        ({"recording": {"arena": "file"}}, None),
        ({"tank": {"shape": "rectangle", "width_m": 0.4, "height_m": 0.3}}, "rect:0.4x0.3"),
        ({"tank": {"shape": "polygon", "vertices_m": [[0, 0], [1, 0], [0, 1]]}}, None),
    ],
)
def test_arena_of_the_recording(values: dict[str, dict[str, object]], arena: str | None) -> None:
    assert Study(**values).load_options().get("tank") == arena


def test_study_reads_the_bundled_recording() -> None:
    """The bundled recording is simulated; its study is the default one."""
    path = Path(driftwalk.__file__).parent / "datasets" / "tank30_ode_a" / "recording.csv"
    trajectory = load(path, **Study().load_options())
    assert trajectory.sizes["time"] == 18001
    assert Tank.from_arena(trajectory.attrs["arena"]) == Tank()


def test_the_short_template_states_nothing_and_takes_the_tables_of_a_page() -> None:
    short = short_study_template()
    assert len(short.splitlines()) < 25
    study = parse_study(short)
    assert study == Study()
    assert study.tank.model_fields_set == set()
    page = (DOCS / "tutorials" / "first-calibration.md").read_text(encoding="utf-8")
    snippet = page.split("```toml\n")[1].split("```")[0]
    assert "[tank]" in snippet
    assert parse_study(short + snippet).tank.wall_friction == 1.0


def test_the_short_template_without_its_signs_is_the_default_study() -> None:
    lines = [line.removeprefix("# ") for line in short_study_template().splitlines()]
    kept = [line for line in lines if line.startswith("[") or " = " in line]
    study = parse_study("\n".join(kept))
    assert study == Study()
    assert {"side_m", "mass_kg"} <= study.block.model_fields_set
    assert "diameter_m" in study.tank.model_fields_set


def test_a_table_or_a_key_that_stands_twice_is_named_with_its_lines() -> None:
    full = study_template()
    first = full.splitlines().index("[tank]") + 1
    second = len(full.splitlines()) + 1
    where = f"in line {first} and in line {second}"
    with pytest.raises(InputError, match=rf"the table \[tank\] stands twice, {where}"):
        parse_study(full + "[tank]\nwall_friction = 1.0\n")
    with pytest.raises(InputError, match="the key mass_kg stands twice, in line 2 and in line 4"):
        parse_study("[block]\nmass_kg = 1\nside_m = 1\nmass_kg = 2\n")
    with pytest.raises(InputError, match=r"\[tank\] stands twice, in line 1 and in line 2"):
        parse_study("tank.diameter_m = 1\n[tank]\nwall_friction = 1\n")
