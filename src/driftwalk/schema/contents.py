"""What a stored dataset of driftwalk's own has to hold, kind by kind.

Only what a reader relies on stands here: that a variable, where it is there, lies on its dimensions
and is numbers or text, and what must be there at all. Further variables and attributes, of a
later version, pass.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.core.errors import FormatError
from driftwalk.core.json_text import parse_json

if TYPE_CHECKING:
    import xarray as xr

TEXT_VARIABLES: Final = frozenset(
    [
        "angle",
        "body",
        "class",
        "class_over_time",
        "criterion",
        "flow",
        "input",
        "message",
        "output",
        "parameter",
        "shape",
    ]
)
"""Variables that hold names; all others hold numbers. Those of `_EITHER` differ between kinds."""
_EITHER: Final = frozenset(["component", "other_parameter"])
TEXT_ATTRIBUTES: Final = frozenset(
    [
        "angle",
        "arena",
        "backend",
        "bodies",
        "chirality",
        "converged",
        "counts",
        "drawn",
        "explained",
        "findings",
        "format",
        "hidden_face_drag",
        "inertia",
        "input_units",
        "interrupted",
        "kind",
        "ks_left_out",
        "latching",
        "method",
        "recording_name",
        "restricted",
        "simulated",
        "simulated_recording",
        "source",
        "study",
        "tracked_from",
        "tracking_counts",
        "warning",
        "warnings",
        "y_axis",
    ]
)
JSON_ATTRIBUTES: Final[dict[str, type[Any]]] = {
    "arena": dict,
    "arena_found": dict,
    "counts": dict,
    "tracking_counts": dict,
    "origin_shift_m": list,
    "warnings": list,
    "findings": list,
    "bodies": list,
}
"""Attributes that hold JSON, and what the text is of."""
_JSON_WORDS: Final[dict[Any, str]] = {dict: "object", list: "list"}


class Contents(NamedTuple):
    """What a kind of dataset holds."""

    dims: dict[str, str]
    """Variable to its dimensions: ``[time]`` may be there, ``...`` stands for any before."""
    needed: tuple[str, ...] = ()
    """Variables without which there is nothing to read."""
    attributes: tuple[str, ...] = ()
    """Attributes without which there is nothing to read."""


def _contents(*lines: str, needed: str = "", attributes: str = "") -> Contents:
    """Build contents from lines such as ``"x y theta: time body"``."""
    dims = {}
    for line in lines:
        names, _, on = line.partition(":")
        dims.update(dict.fromkeys(names.split(), on.strip()))
    return Contents(dims, tuple(needed.split()), tuple(attributes.split()))


_COARSE: Final = "drag_coefficient force_std"
_REFINED: Final = "refined_drag_coefficient refined_force_std"
_BINS: Final = "density_step_length density_turning_angle"
_FIELD: Final = "[flow] [time] y x"

KINDS: Final[dict[str, Contents]] = {
    "trajectory": _contents(
        "x y theta ambiguous: time body",
        "covariance: time body part",
        "time: time",
        "body: body",
        needed="x y theta time body",
    ),
    "simulation": _contents(
        "x y theta: replicate time body",
        "status: replicate",
        "time: time",
        "body: body",
        needed="x y theta time body",
    ),
    "flow_field": _contents(
        f"u v flag u_block v_block count u_standard_error v_standard_error: {_FIELD}",
        "x: x",
        "y: y",
        "time: time",
        needed="u v x y",
    ),
    "calibration": _contents(
        f"ks_distance ks_distance_standard_error status: {_COARSE}",
        "drag_coefficient: drag_coefficient",
        "force_std: force_std",
        f"ks_distance_replicate ks_step_length ks_turning_angle ks_quadrant: {_COARSE} replicate",
        f"excerpt_x excerpt_y: {_COARSE} excerpt_sample",
        "excerpt_time: excerpt_sample",
        f"step_density: {_COARSE} {_BINS}",
        f"recording_step_density: {_BINS}",
        "recording_step_length recording_turning_angle: recording_step",
        "step_length_edge: step_length_edge",
        "turning_angle_edge: turning_angle_edge",
        f"refined_ks_distance refined_ks_distance_standard_error refined_status: {_REFINED}",
        f"refined_surface: {_REFINED}",
        "refined_drag_coefficient: refined_drag_coefficient",
        "refined_force_std: refined_force_std",
        f"refined_ks_distance_replicate: {_REFINED} refined_replicate",
        "bootstrap_drag_coefficient bootstrap_force_std bootstrap_ks_distance: bootstrap",
        "region_drag_coefficient region_force_std: region_vertex",
        needed="ks_distance drag_coefficient force_std",
        attributes="drag_coefficient force_std_N force_interval_s study warnings",
    ),
    "fit": _contents(
        f"u v u_standard_error v_standard_error count flag: {_FIELD}",
        "x: x",
        "y: y",
        "flow: flow",
        "interval_flow: interval",
        "coefficient: [flow] component knot_y knot_x",
        "parameter: parameter",
        "other_parameter: other_parameter",
        "covariance: parameter other_parameter",
        "profile profile_deviance profile_half_log_determinant: profile",
        needed="u v x y",
        attributes="drag_coefficient force_std_N force_interval_s",
    ),
    "model_check": _contents(
        "autocorrelation autocorrelation_expected autocorrelation_std: component lag",
        "chi_squared_per_dof chi_squared_expected excess_kurtosis tail_share: component",
        "component: component",
        "lag: lag",
        "residual: component y x",
        "residual_count residual_distance noise_ratio noise_ratio_std: y x",
        "x: x",
        "y: y",
        "part_residual: part component",
        "part_recording part_start part_end part_count part_chi_squared part_dof: part",
        "part_noise_ratio part_noise_ratio_std flow_change flow_change_std: part",
        "drag_change drag_change_std speed_low speed_high: speed_range",
        "ks_to_estimate: replicate",
        "ks_floor: pair",
        "ks_to_drawn ks_between_drawn: drawn_replicate",
        "p_value failed criterion: criterion",
        *(
            f"{what}_density_{which}: {what}_bin"
            for what in ("step_length", "turning_angle")
            for which in ("recording", "median", "low", "high")
        ),
        "step_length_edge: step_length_edge",
        "turning_angle_edge: turning_angle_edge",
    ),
    "assembly": _contents(
        "run event_count first_contact_time completion_time end_time outcome status: run",
        "drag_coefficient force_std flow_draw: run",
        "event_time event_class: run event",
        "event_block event_face event_assembly: run event side",
        "event_shape: run event part",
        "x y theta quarter assembly: run block",
        "cell: run block axis",
        "block: block",
        "class: class",
        "shape: shape",
        needed="outcome status class",
    ),
    "assembly_path": _contents(
        "x y theta assembly: run time block",
        "run: run",
        "time: time",
        "block: block",
        needed="x y theta run time block",
        attributes="block_side_m",
    ),
    "outcome_distribution": _contents(
        "count proportion interval_low interval_high standard_deviation class: class",
        "realisation_count realisation_proportion: realisation class",
        "count_over_time: time class_over_time",
        "time: time",
        "class_over_time: class_over_time",
        needed="proportion class",
    ),
    "class_times": _contents(
        "proportion proportion_low proportion_high: time class",
        *(f"{what}{end}: time" for what in ("first_contact", "completion") for end in
          ("", "_low", "_high")),
        "time: time",
        "class: class",
        needed="proportion time class",
    ),
    "sensitivity": _contents(
        "count proportion: ... class",
        "count_over_time: ... time class_over_time",
        "reference_over_time: time class_over_time",
        "time: time",
        "reference class: class",
        "class_over_time: class_over_time",
        needed="proportion class",
    ),
    "components": _contents(
        "score: ... component",
        "loading: class component",
        "explained_variance_ratio complete_correlation component: component",
        "mean class: class",
        needed="score loading class",
    ),
    "sobol_indices": _contents(
        "first_order first_order_half_width total_order total_order_half_width: output input",
        "first_order_corrected total_order_corrected: output input",
        "variance noise_share output: output",
        "proportion: setting output",
        "value: setting input",
        "low high input: input",
        needed="first_order total_order output input",
    ),
    "recovery": _contents(
        "status used message: duration angle recording",
        "duration: duration",
        "angle: angle",
        "parameter: parameter",
        "coverage coverage_low coverage_high bias spread rms_error: parameter duration angle",
        needed="status duration angle",
    ),
}  # fmt: skip


def check_contents(dataset: xr.Dataset, path: Path) -> xr.Dataset:
    """Return a dataset that holds what its kind needs; one of no kind of driftwalk's as it is.

    Raises
    ------
    FormatError
        When a variable or attribute is missing, lies on other dimensions, or is text for numbers or
        numbers for text.
    """
    kind = dataset.attrs.get("kind")
    contents = KINDS.get(kind) if isinstance(kind, str) else None
    if contents is None:
        return dataset
    for name in contents.needed:
        if name not in dataset.variables:
            raise FormatError(f"is damaged: its {kind} lacks the variable '{name}'", path=path)
    for name, on in contents.dims.items():
        if name in dataset.variables:
            _check_variable(dataset, name, on, path)
    for name in contents.attributes:
        if name not in dataset.attrs:
            raise FormatError(f"is damaged: its {kind} lacks the attribute '{name}'", path=path)
    for name, value in dataset.attrs.items():
        _check_attribute(str(name), value, path)
    return dataset


def _check_variable(dataset: xr.Dataset, name: str, on: str, path: Path) -> None:
    variable = dataset.variables[name]
    dims = tuple(str(dim) for dim in variable.dims)
    if not _lie_on(dims, on.split()):
        raise FormatError(
            f"is damaged: '{name}' lies on ({', '.join(dims)}), expected ({', '.join(on.split())})",
            path=path,
        )
    if name in _EITHER:
        return
    if name in TEXT_VARIABLES:
        if not _is_text(variable.values):
            raise FormatError(f"is damaged: '{name}' holds no text", path=path)
    elif variable.dtype.kind not in "fiub":
        raise FormatError(f"is damaged: '{name}' holds no numbers", path=path)


def _lie_on(dims: tuple[str, ...], expected: list[str]) -> bool:
    if expected[:1] == ["..."]:
        rest = expected[1:]
        return len(dims) >= len(rest) and dims[len(dims) - len(rest) :] == tuple(rest)
    optional = [name[1:-1] for name in expected if name.startswith("[")]
    return dims == tuple(
        name.strip("[]") for name in expected if name[1:-1] not in optional or name[1:-1] in dims
    )


def _is_text(values: Any) -> bool:
    return values.dtype.kind == "U" or all(isinstance(value, str) for value in values.flat)


def _check_attribute(name: str, value: Any, path: Path) -> None:
    if name in TEXT_ATTRIBUTES and not isinstance(value, str):
        raise FormatError(f"is damaged: its attribute '{name}' is no text", path=path)
    if name in JSON_ATTRIBUTES and isinstance(value, str) and value:
        expected = JSON_ATTRIBUTES[name]
        try:
            found = parse_json(value)
        except FormatError as error:
            raise FormatError(
                f"is damaged: its attribute '{name}' is no JSON ({error})", path=path
            ) from error
        if not isinstance(found, expected):
            raise FormatError(
                f"is damaged: its attribute '{name}' holds no JSON {_JSON_WORDS[expected]}",
                path=path,
            )
    if name.endswith("_interval") and np.asarray(value).dtype.kind not in "fiu":
        raise FormatError(f"is damaged: its attribute '{name}' is no interval", path=path)
