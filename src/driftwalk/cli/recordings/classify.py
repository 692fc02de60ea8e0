"""`driftwalk classify`: what the blocks of a recording assembled into."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from driftwalk.cli.inputs.other_files import explained
from driftwalk.cli.inputs.recordings import open_kind
from driftwalk.cli.options.flatten_options import option_field, with_options
from driftwalk.cli.options.recording import RecordingOptions, with_recording_options
from driftwalk.cli.options.shared_types import Json, Replace, argument, optional
from driftwalk.cli.options.study import StudyOptions, with_study_options
from driftwalk.cli.terminal.output import (
    print_json,
    print_next,
    print_note,
    print_table,
    print_warnings,
    save_dataset,
)
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.core.files.run_layout import MANIFEST_FILE
from driftwalk.core.study_keys import STUDY_KEYS
from driftwalk.core.units import in_percent
from driftwalk.schema.shapes import is_one_assembly, short_class

if TYPE_CHECKING:
    import xarray as xr

_PANEL = "Criteria of a join"
# Centres of blocks that touch are a side apart, and noise takes off a little; chosen by hand.
_TOO_CLOSE = 0.8


_tolerance = partial(option_field, panel=_PANEL)


@dataclass(frozen=True)
class JoinCriteria:
    """When faces join and part; the fields are the options."""

    join_distance: float | None = _tolerance(
        "--join-distance", "Distance of face centres that join (default: side / 10).", unit="m"
    )
    join_angle: float | None = _tolerance(
        "--join-angle", "Angle between faces that join (default: 10deg).", unit="rad"
    )
    release_distance: float | None = _tolerance(
        "--release-distance", "Distance that parts them (default: twice that to join).", unit="m"
    )
    release_angle: float | None = _tolerance(
        "--release-angle", "Angle that parts them (default: twice that to join).", unit="rad"
    )
    min_duration: float | None = _tolerance(
        "--min-duration", "Shortest join or parting that counts (default: 0.5s).", unit="s"
    )
    hold: float | None = _tolerance(
        "--hold", "Time for which an unseen block keeps its joins (default: 1s).", unit="s"
    )
    play: float | None = _tolerance(
        "--play",
        "How far joined faces may move against each other (default: as far as noise does).",
        unit="m",
    )


@with_options(JoinCriteria)
@with_recording_options
@with_study_options(STUDY_KEYS, "side")
def classify(
    poses: Annotated[Path, argument("POSES", "Recording of all blocks with their orientations.")],
    given: StudyOptions,
    how: RecordingOptions,
    criteria: JoinCriteria,
    chirality: Literal["merged", "distinct"] = optional(
        "--chirality", "Mirror images as one shape or two.", default="merged"
    ),
    out: Path | None = optional("--out -o FILE.nc", "File for the result."),
    overwrite: Replace = False,
    json: Json = False,
) -> None:
    """Say what the blocks of a recording assembled into, and when.

    Blocks are joined if two faces stay close to each other and face each other. The outcome class
    is the multiset of the shapes that they form. The side of the blocks comes from the recording or
    the study; the default is 3 cm.
    """
    from driftwalk.assembly import classify as classify_recording
    from driftwalk.core.files.atomic import require_target

    if out is not None:
        require_target(out, existing="replace" if overwrite else "error", endings=(".nc",))
    recording, block_side, is_default = _load(poses, how, given)
    stated = {name: value for name, value in vars(criteria).items() if value is not None}
    try:
        found = classify_recording(recording, side=block_side, chirality=chirality, **stated)
    except ConfigurationError:
        raise
    except InputError as error:
        raise InputError(f"{poses}: {error}") from error
    if out is not None:
        save_dataset(found, out)
    summary = summarise(found)
    if json:
        print_json({"poses": poses, **summary})
        return
    _print(summary)
    print_warnings(summary["warnings"])
    if is_default:
        print_note(f"the side of the blocks is the default, {100 * block_side:g} cm (--side)")
    # A file of a run is shown with its run.
    place = poses.parent if (poses.parent / MANIFEST_FILE).is_file() else poses
    print_next("report", place, *(how.words() if place == poses else []), "-o", "report.html")


def summarise(found: xr.Dataset) -> dict[str, Any]:
    """Return what a classification found with units in the keys, ready for JSON."""
    names = [str(name) for name in found["class"].values]
    facts = {
        key: value
        for key, value in found.attrs.items()
        if key not in ("kind", "schema_version", "source", "arena")
    }
    final = _name(names, found["outcome"].values[-1])
    return {
        **facts,
        "bodies": found["body"].values,
        "classes": _changes(found, names),
        "proportions": {
            name: share
            for name, share in zip(names, found["proportion"].values.tolist(), strict=True)
            if share > 0
        },
        "final": final,
        "complete": is_one_assembly(final) if final else None,
        "rates": _rates(found),
        "events": _events(found, names),
        "warnings": _warnings(found),
    }


def _load(path: Path, how: RecordingOptions, given: StudyOptions) -> tuple[xr.Dataset, float, bool]:
    """Return the recording or simulated run, the side of its blocks [m], and if it is a default."""
    from driftwalk.assembly import path_recording
    from driftwalk.conditions import load_with_study
    from driftwalk.model import Block

    simulated = open_kind(path, "assembly_path")
    if simulated is not None:
        chosen = int(simulated["run"][0]) if how.replicate is None else how.replicate
        return path_recording(simulated, run=chosen), float(simulated.attrs["block_side_m"]), False
    if given.file is None:
        # Without a study the size of the tank is not stated: the blocks need not fit into it.
        stated = given.overrides.get(STUDY_KEYS["side"])
        own = Block().side_m if stated is None else stated
        recording = how.load(path, side=own)
        # A circle that is fitted was widened by the default side, which the recording does not say.
        if stated is None and how.tank != "fit" and "block_side_m" in recording.attrs:
            return recording, float(recording.attrs["block_side_m"]), False
        return recording, own, stated is None
    resolved = given.study()
    with explained():
        return load_with_study(path, resolved, how.arguments()), resolved.block.side_m, False


def _name(names: list[str], index: int) -> str:
    return names[index] if index >= 0 else ""


def _changes(found: xr.Dataset, names: list[str]) -> list[dict[str, Any]]:
    """Return the class at the first sample and at each sample where it is another one."""
    outcome, time = found["outcome"].values.tolist(), found["time"].values.tolist()
    return [
        {"time_s": time[at], "outcome": _name(names, outcome[at])}
        for at in range(len(outcome))
        if at == 0 or outcome[at] != outcome[at - 1]
    ]


def _events(found: xr.Dataset, names: list[str]) -> list[dict[str, Any]]:
    """Return joins and partings in order of time, at the same sample partings first."""
    bodies = [str(name) for name in found["body"].values]
    events = [
        {
            "time_s": found[f"{kind}_time"].values[at],
            "kind": word,
            "bodies": [bodies[block] for block in found[f"{kind}_block"].values[at]],
            "faces": found[f"{kind}_face"].values[at],
            "outcome": _name(names, found[f"{kind}_class"].values[at]),
        }
        for kind, word in (("split", "split"), ("event", "join"))
        for at in range(int(found[f"{kind}_count"]))
    ]
    return sorted(events, key=lambda event: float(event["time_s"]))


def _rates(found: xr.Dataset) -> dict[str, Any]:
    """Return how often blocks joined and parted in each class that came, per second in it."""
    rates: dict[str, Any] = {}
    for kind in ("joining", "parting"):
        for place, name in enumerate(str(one) for one in found["class"].values):
            rate, low, high = (
                float(found[f"{kind}_rate{end}"][place]) for end in ("", "_low", "_high")
            )
            if rate == rate:
                rates.setdefault(name, {})[kind] = {
                    "count": int(found[f"{kind}_count"][place]),
                    "per_s": rate,
                    "interval_per_s": [low, high],
                }
    return rates


def _rate_table(summary: dict[str, Any]) -> None:
    """Print the rates, where anything joined or parted."""
    if not summary["events"]:
        return
    interval = f"{in_percent(summary['rate_confidence'])} interval"
    rows = []
    for name, rates in summary["rates"].items():
        cells: list[Any] = [short_class(name)]
        for kind in ("joining", "parting"):
            one = rates[kind]
            low, high = one["interval_per_s"]
            cells += [one["count"], f"{one['per_s']:.3g}", f"{low:.3g} to {high:.3g}"]
        rows.append(cells)
    heads = ["class", "joinings", "(1/s)", interval, "partings", "(1/s)", interval]
    print_table(rows, columns=heads)
    print()
    if (rate := summary.get("bond_rate_per_s")) is not None:
        low, high = summary["bond_rate_low_per_s"], summary["bond_rate_high_per_s"]
        print(f"a bond breaks at {rate:.3g} /s   {interval} {low:.3g} to {high:.3g}\n")


def _warnings(found: xr.Dataset) -> list[str]:
    facts = found.attrs
    said = []
    if facts["closest_m"] < _TOO_CLOSE * facts["block_side_m"]:
        said.append(
            f"two blocks come as close as {100 * facts['closest_m']:.3g} cm, which a side of "
            f"{100 * facts['block_side_m']:.3g} cm does not allow: is it right (--side)?"
        )
    if facts["dropped_joins"]:
        said.append(
            f"{facts['dropped_joins']} joins contradict others on the lattice and were dropped"
        )
    if facts["left_out_contacts"]:
        said.append(
            f"{facts['left_out_contacts']} contacts at rest are left out, because their faces do "
            "not lie as in a join; a wider --play counts more of them"
        )
    if facts["unknown_samples"]:
        said.append(
            f"at {facts['unknown_samples']} of {found.sizes['time']} samples the class is unknown: "
            f"a block was not seen for more than {facts['hold_s']:g} s (--hold)"
        )
    return said


def _print(summary: dict[str, Any]) -> None:
    known = summary["known_s"]
    rows = [
        [short_class(name), 100.0 * share, share * known]
        for name, share in summary["proportions"].items()
    ]
    print_table(rows, columns=["class", "share of time (%)", "time (s)"])
    print()
    listed = [
        [
            event["time_s"],
            event["kind"],
            *(f"{body}:{face}" for body, face in zip(event["bodies"], event["faces"], strict=True)),
            short_class(event["outcome"]),
        ]
        for event in summary["events"]
    ]
    if listed:
        columns = ["time (s)", "event", "block:face", "block:face", "class afterwards"]
        print_table(listed, columns=columns)
    else:
        print("no blocks joined")
    print()
    _rate_table(summary)
    print_table([["at the end", short_class(summary["final"]) or "unknown"]])
