"""`driftwalk info`: the contents of a recording, and how driftwalk reads them."""

from __future__ import annotations

from typing import Any

from driftwalk.cli.options.recording import RecordingFile, RecordingOptions, with_recording_options
from driftwalk.cli.options.shared_types import FlowVariables, FrameInterval, Json
from driftwalk.cli.options.study import Side
from driftwalk.cli.terminal.argument_names import to_options
from driftwalk.cli.terminal.output import print_json, print_next, print_table, print_warnings

SIDE_BY_SIDE = 5
"""Bodies shown as columns; more are shown as rows, with fewer numbers."""

MOST_UNREAD = 12
"""Columns that are not read, of which each has a row; chosen by hand."""

_ROWS: list[tuple[str, str, float]] = [
    ("samples", "samples", 1),
    ("orientation", "has_orientation", 1),
    ("duration (s)", "duration_s", 1),
    ("from (s)", "start_s", 1),
    ("to (s)", "stop_s", 1),
    ("rate (Hz)", "rate_Hz", 1),
    ("interval, 5 % (ms)", "interval_5_percent_s", 1e3),
    ("interval, median (ms)", "interval_median_s", 1e3),
    ("interval, 95 % (ms)", "interval_95_percent_s", 1e3),
    ("uneven intervals (%)", "uneven_intervals_share", 100),
    ("gaps", "gaps", 1),
    ("longest gap (s)", "longest_gap_s", 1),
    ("time in gaps (%)", "gap_time_share", 100),
    ("x from (cm)", "x_min_m", 100),
    ("x to (cm)", "x_max_m", 100),
    ("y from (cm)", "y_min_m", 100),
    ("y to (cm)", "y_max_m", 100),
    ("speed, mean (cm/s)", "speed_mean_m_s", 100),
    ("speed, 99 % (cm/s)", "speed_99_percent_m_s", 100),
    ("speed, largest (cm/s)", "speed_max_m_s", 100),
    ("turn rate, mean (rad/s)", "turn_rate_mean_rad_s", 1),
    ("position noise (mm)", "position_noise_m", 1e3),
    ("  standard error (mm)", "position_noise_standard_error_m", 1e3),
    ("orientation noise (deg)", "orientation_noise_rad", 57.29577951308232),
    ("  standard error (deg)", "orientation_noise_standard_error_rad", 57.29577951308232),
    ("identity ambiguous (%)", "ambiguous_share", 100),
]
"""Rows of a recording: label, name of the fact, and the factor from SI to the unit shown."""
_CIRCLE_ROWS: list[tuple[str, str, float]] = [
    ("circle of centres: radius (cm)", "radius_m", 100),
    ("  rim visited (%)", "sectors_visited_share", 100),
]
"""The same of the circle that is fitted to the positions."""
_OF_A_RECORDING: list[tuple[str, str, float]] = [
    ("tracks", "tracks_used", 1),
    ("samples", "samples_used", 1),
    ("standard error, median (cm/s)", "standard_error_median_m_s", 100),
]
"""Rows of a flow field that was taken from a recording."""
_TRACKED = ["ambiguous_share"]
_BRIEF = [
    *("samples", "duration_s", "rate_Hz", "gaps", "speed_mean_m_s", "position_noise_m"),
    *_TRACKED,
]
_TRACKING = {
    "frames": "frames tracked",
    "dropped": "frames dropped",
    "duplicates": "frames doubled",
    "stale": "frames stale",
}
_COUNTS = {
    "rows": "rows of these bodies",
    "missing": "without a position",
    "without_time": "without a time, dropped",
    "duplicates_dropped": "same time again, earlier dropped",
    "times_in_two_places": "  of these, times in two places",
    "unsorted": "times out of order, sorted",
    "outside_window": "outside --from and --to",
    "jumps_removed": "jumps made gaps",
    "impossible_steps": "impossible steps left",
    "samples": "samples left",
}


@with_recording_options
def info(
    recording: RecordingFile,
    how: RecordingOptions,
    side: Side = None,
    frame_interval: FrameInterval = None,
    flow_variables: FlowVariables = None,
    json: Json = False,
) -> None:
    """Say what a recording, a flow field or a run directory holds, and how driftwalk reads it.

    For a recording, prints bodies, clock and its jitter, gaps, extent, the circle that contains the
    centres, speed, and the tracking noise estimated from the recording itself. For a finished run,
    prints its answer; `driftwalk report` shows the outcomes of self-assembly.
    """
    from driftwalk.cli.terminal.output import print_run
    from driftwalk.core.files.run_layout import state_of

    if recording.is_dir() and state_of(recording) != "new":
        how.refuse_given(f"{recording} is a directory, read as a run")
        print_run(recording, json=json)
        return
    from driftwalk.cli.inputs.flow_file import describe_field, read_flow_file
    from driftwalk.cli.inputs.recordings import words_to_fit
    from driftwalk.record import describe

    field = read_flow_file(recording, how, frame_interval=frame_interval, variables=flow_variables)
    if field is not None:
        _print_field(describe_field(field), json=json)
        return
    trajectory = how.load(recording, side=side)
    described = describe(trajectory)
    if json:
        print_json(described)
        return
    _print_file(described)
    print()
    if described["columns"]:
        _print_columns(described["columns"])
        print()
    _print_bodies(described["bodies"])
    print()
    if described["tracking"] is not None:
        _print_tracking(described["tracking"])
        print()
    _print_counts(described["counts"])
    print_warnings(described["warnings"])
    block = [] if side is None else ["--side", f"{side:.12g}"]
    words = [*how.words(), *block, *words_to_fit(trajectory, described)]
    # A body that never moves cannot be fitted.
    if any(body.get("speed_max_m_s") for body in described["bodies"].values()):
        print_next("fit", recording, *words, "-o", f"{recording.stem}-fit")


def _print_field(described: dict[str, Any], *, json: bool) -> None:
    """Print what a flow field holds."""
    if json:
        print_json(described)
        return
    print_table(
        [
            ["file", described["source"] or "-"],
            ["method", described["method"] or "-"],
            *([["read as", described["reading"]]] if described["reading"] else []),
            ["flow field", f"{described['columns']} x {described['rows']} nodes"],
            ["frames", described["frames"]],
            *(
                [f"{axis} {word} (cm)", 100 * described[f"{axis}_{side}_m"]]
                for axis in ("x", "y")
                for word, side in (("from", "min"), ("to", "max"))
            ),
            ["measured nodes (%)", 100 * described["measured_share"]],
            ["speed, mean (cm/s)", 100 * described["speed_mean_m_s"]],
            ["speed, largest (cm/s)", 100 * described["speed_max_m_s"]],
            *(
                [label, factor * described[key]]
                for label, key, factor in _OF_A_RECORDING
                if key in described
            ),
        ]
    )
    print_warnings(described["warnings"])


def _print_file(described: dict[str, Any]) -> None:
    rows: list[list[Any]] = [
        ["file", described["source"]],
        ["format", described["format"]],
        ["y axis", described["y_axis"]],
        ["bodies", len(described["bodies"])],
        ["arena", _arena_text(described)],
        ["resolution (mm)", _scaled(described["position_quantum_m"] or None, 1e3)],
    ]
    if described["time_origin"] is not None:
        rows.append(["t = 0 is", described["time_origin"]])
    if described["metres_per_pixel"] is not None:
        rows.append(["scale [mm/pixel]", described["metres_per_pixel"] * 1e3])
    print_table(rows)


def _print_columns(columns: list[dict[str, str]]) -> None:
    """Print what each column was taken for, in which unit, and why."""
    shown = [one for one in columns if one["meaning"] != "not read"]
    rest = [one for one in columns if one["meaning"] == "not read"]
    shown += rest[:MOST_UNREAD]
    rows = [[one["column"], one["meaning"], one["unit"], to_options(one["why"])] for one in shown]
    if len(rest) > MOST_UNREAD:
        rows.append([f"{len(rest) - MOST_UNREAD} more", "not read", "", ""])
    print_table(rows, columns=["column", "taken for", "unit", "why"])


def _arena_text(described: dict[str, Any]) -> str:
    arena = described["arena"]
    if arena is None:
        return "not stated (--tank)"
    if arena["shape"] == "circle":
        size = f"circle, diameter {arena['diameter_m'] * 100:.4g} cm"
    elif arena["shape"] == "rectangle":
        size = f"rectangle, {arena['width_m'] * 100:.4g} x {arena['height_m'] * 100:.4g} cm"
    else:
        size = f"polygon with {len(arena['vertices_m'])} vertices"
    found = described["arena_found"] or {}
    center = found.get("center_m")
    where = "" if center is None else f"; centre at x {center[0]:.4g} m, y {center[1]:.4g} m"
    return size + where + (f" ({found['by']})" if "by" in found else "")


def _scaled(value: Any, factor: float) -> Any:
    if value is None or isinstance(value, bool):
        return {None: "-", True: "yes", False: "no"}[value]
    return value if factor == 1 else value * factor


def _print_bodies(bodies: dict[str, dict[str, Any]]) -> None:
    known = [
        row for row in _ROWS if row[1] not in _TRACKED or any(row[1] in b for b in bodies.values())
    ]
    if len(bodies) > SIDE_BY_SIDE:
        chosen = [row for row in known if row[1] in _BRIEF]
        lines = [
            [name, *(_scaled(body.get(key), factor) for _, key, factor in chosen)]
            for name, body in bodies.items()
        ]
        print_table(lines, columns=["body", *(label for label, _, _ in chosen)])
        return
    rows = [
        [label, *(_scaled(body.get(key), factor) for body in bodies.values())]
        for label, key, factor in known
    ]
    rows += [
        [label, *(_scaled((b["circle_of_centers"] or {}).get(key), f) for b in bodies.values())]
        for label, key, f in _CIRCLE_ROWS
    ]
    print_table(rows, columns=["body", *bodies])


def _print_tracking(tracking: dict[str, Any]) -> None:
    """Print what became of the frames, and why a recording ends early."""
    rows: list[list[Any]] = [["tracked from", tracking["tracked_from"] or "-"]]
    rows += [[label, tracking[key]] for key, label in _TRACKING.items() if key in tracking]
    rows.append(["complete", "yes" if tracking["complete"] else "no"])
    if tracking["interrupted"] is not None:
        rows.append(["ended because", to_options(tracking["interrupted"])])
    print_table(rows)


def _print_counts(counts: dict[str, Any]) -> None:
    """Print what reading and cleaning met, for all bodies together."""
    rows = [["rows in the file", counts["rows_in_file"]]] if "rows_in_file" in counts else []
    rows += [[label, counts[key]] for key, label in _COUNTS.items() if key in counts]
    print_table(rows)
