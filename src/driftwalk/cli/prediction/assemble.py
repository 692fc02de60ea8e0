"""`driftwalk assemble`: what many blocks build, and how often."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from driftwalk.cli.inputs.assembly_source import (
    RUN_HELP,
    RUN_NAMES,
    refuse_found,
    source_from_flow,
    source_from_run,
)
from driftwalk.cli.inputs.study_recording import opening_note
from driftwalk.cli.options.cluster import ClusterAt, ClusterOptions, Workers
from driftwalk.cli.options.shared import FlowFile, Json, Overwrite, RunFolder, Threads
from driftwalk.cli.options.study import StudyOptions, with_study_options
from driftwalk.cli.terminal.answer import print_figures, print_report_next, print_warnings
from driftwalk.cli.terminal.output import print_json, print_table
from driftwalk.cli.terminal.sizes_answer import print_sizes, sizes_facts
from driftwalk.core.errors import InputError
from driftwalk.core.study_keys import ASSEMBLY_KEYS
from driftwalk.schema.kinds.flow_series import flow_series_words

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study
    from driftwalk.runs import AssemblyResult

MOST_ROWS = 16
"""Classes in the printed table: all 12 of four blocks, and the frequent ones of more."""


@with_study_options(ASSEMBLY_KEYS, "runs", *RUN_NAMES)
def assemble(
    out: RunFolder,
    given: StudyOptions,
    run: Annotated[
        Path | None,
        typer.Argument(metavar="RUN", help=RUN_HELP, show_default=False),
    ] = None,
    flow: FlowFile = None,
    film: Annotated[
        str, typer.Option("--film", metavar="gif|mp4|none", help="Film of the first run.")
    ] = "gif",
    threads: Threads = None,
    cluster: ClusterAt = None,
    cluster_options: ClusterOptions = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Simulate self-assembly of many blocks, and report how often each structure forms.

    With the RUN of a fit or a calibration, uses its flow field and simulates twice: with the
    parameters that it found, and with parameters drawn from what it leaves open. The difference
    shows its remaining uncertainty. Without RUN, uses the parameters of a study and a flow field
    (--flow). After a kill, the same command continues.
    """
    from driftwalk.runs import AssemblyWork, run_work

    _check_film(film)
    if run is None:
        source = source_from_flow(given, flow)
    else:
        refuse_found(run, given.overrides, also=[] if given.file is None else ["--study"])
        source = source_from_run(run, flow, given)
    work = AssemblyWork(source.study, source.flow, source.uncertainty, source.inputs, threads, film)
    begun = opening_note(source.study, given, about="simulation", otherwise=str(run))
    with Workers(cluster, cluster_options).reported("assemble") as told:
        result = run_work(work, out, overwrite=overwrite, begun=begun, **told)
    series = flow_series_words(result.distribution.attrs, holds="the intervals hold")
    drawn = [] if source.not_drawn is None else [source.not_drawn]
    warnings = [*source.warnings, *drawn, *series, *_left_out(result)]
    if json:
        print_json({**summary(work.study, result), "warnings": warnings})
        return
    print_answer(work.study, result, out)
    print_warnings(warnings)
    print_report_next(*([] if run is None else [run]), out)


def _check_film(film: str) -> None:
    """Refuse a film that cannot be made before anything is simulated for it."""
    if film not in ("gif", "mp4", "none"):
        raise InputError(f"--film takes gif, mp4 or none, got '{film}'")
    if film != "none":
        from driftwalk.plot import require_film_writer

        require_film_writer(f".{film}")


def summary(study: Study, result: AssemblyResult) -> dict[str, Any]:
    """Return what ``--json`` prints: the answer with units in its keys."""
    settings, forces, times = study.assembly, study.forces, result.times.attrs
    return {
        **_facts(result.distribution, result.sizes),
        "confidence": settings.confidence,
        "blocks": settings.blocks,
        "duration_s": times["duration_s"],
        "seed": settings.seed,
        "latching": settings.latching,
        "hidden_face_drag": settings.hidden_face_drag,
        "chirality": settings.chirality,
        "drag_coefficient": forces.drag_coefficient,
        "force_std_N": forces.force_std_N,
        "force_interval_s": forces.force_interval_s,
        "first_contact_median_s": times["first_contact_median_s"],
        "completion_median_s": times["completion_median_s"],
        "drawn": None
        if result.drawn is None
        else {"parameters": _drawn(result.drawn), **_facts(result.drawn, result.sizes_drawn)},
        **_difference(result),
    }


def _facts(distribution: xr.Dataset, sizes: xr.Dataset | None) -> dict[str, Any]:
    facts = distribution.attrs
    names = [str(name) for name in distribution["class"].values]
    low, high = (distribution[f"interval_{end}"].values for end in ("low", "high"))
    return {
        "proportions": dict(zip(names, distribution["proportion"].values, strict=True)),
        "intervals": {name: [low[index], high[index]] for index, name in enumerate(names)},
        "complete": facts["complete"],
        "complete_interval": [facts["complete_low"], facts["complete_high"]],
        "runs": facts["runs"],
        "left_out": facts["left_out"],
        **({} if sizes is None else {"sizes": sizes_facts(sizes)}),
    }


def _drawn(distribution: xr.Dataset) -> list[str]:
    """Return what was drawn for each run."""
    return str(distribution.attrs["drawn"]).split()


def _difference(result: AssemblyResult) -> dict[str, float]:
    """Return how far the two distributions are apart, and how far they would be by chance."""
    from driftwalk.assembly import l1_distance, l1_noise_floor

    if result.drawn is None:
        return {}
    pair = (result.distribution, result.drawn)
    counts = [dict(zip(d["class"].values, d["count"].values, strict=True)) for d in pair]
    runs = [int(d.attrs["runs"]) for d in pair]
    names = dict.fromkeys([*counts[0], *counts[1]])
    pooled = {
        str(name): float(sum(count.get(name, 0) for count in counts)) / sum(runs) for name in names
    }
    floor = l1_noise_floor(pooled, *runs)
    return {
        "l1_distance": l1_distance(*pair),
        "l1_noise_floor": floor.mean,
        "l1_noise_floor_95": floor.quantile,
    }


def print_answer(study: Study, result: AssemblyResult, folder: Path) -> None:
    """Print the distributions for people, side by side, and where the figures are."""
    settings, forces, facts = study.assembly, study.forces, result.distribution.attrs
    print(
        f"{settings.blocks} blocks, {facts['runs']} runs of {settings.duration_s:g} s; "
        f"C_d = {forces.drag_coefficient:.4g}, σ_F = {1e3 * forces.force_std_N:.4g} mN redrawn "
        f"every {1e3 * forces.force_interval_s:g} ms"
    )
    if result.sizes is None:
        _print_classes(result, settings.confidence)
    else:
        _print_many(result)
    times = result.times.attrs
    for event, words in (("first_contact", "first contact"), ("completion", "completion")):
        median = times[f"{event}_median_s"]
        reached = f"median {median:.4g} s" if median == median else "not reached in half the runs"
        print(f"{words}: {reached}")
    if result.drawn is not None:
        print(f"drawn for each run: {', '.join(_drawn(result.drawn))}")
    if result.drawn is not None and result.sizes is None:
        apart = _difference(result)
        print(
            f"l1 distance of the two: {apart['l1_distance']:.4f}; by chance "
            f"{apart['l1_noise_floor']:.4f} (95 %: {apart['l1_noise_floor_95']:.4f})"
        )
    print_figures(folder)


def _print_classes(result: AssemblyResult, confidence: float) -> None:
    """Print how often each class came."""
    columns = [result.distribution, *([] if result.drawn is None else [result.drawn])]
    interval = f"{confidence:.0%} simultaneous intervals"
    heads = ["class", "share", interval]
    if result.drawn is not None:
        heads += ["parameters drawn", interval]
    seen = _seen(columns)
    shown = _most_frequent(columns, seen)
    rows = [
        [name, *(cell for column in columns for cell in _cells(column, name))] for name in shown
    ]
    if len(seen) > len(shown):
        rest = [name for name in seen if name not in shown]
        rows.append(
            [f"{len(rest)} others", *(cell for c in columns for cell in (_share_of(c, rest), ""))]
        )
    rows.append(["complete", *(cell for column in columns for cell in _complete_cells(column))])
    print_table(rows, columns=heads)


def _print_many(result: AssemblyResult) -> None:
    """Print the sizes of the assemblies: nearly every run is a class of its own."""
    from driftwalk.figures import LABELS

    both = zip((result.distribution, result.drawn), (result.sizes, result.sizes_drawn), strict=True)
    for label, (distribution, sizes) in zip(LABELS, both, strict=True):
        if distribution is None or sizes is None:
            continue
        print_sizes(sizes, label if result.drawn is not None else "")
        share, interval = _complete_cells(distribution)
        print(
            f"complete: {share} of the runs ({sizes.attrs['confidence']:.0%} interval {interval})"
        )


def _seen(distributions: list[xr.Dataset]) -> list[str]:
    """Return the classes that occurred in any of the distributions, in their order."""
    names = dict.fromkeys(str(n) for d in distributions for n in d["class"].values)
    seen = {
        str(name)
        for d in distributions
        for name, count in zip(d["class"].values, d["count"].values, strict=True)
        if count > 0
    }
    return [name for name in names if name in seen]


def _most_frequent(distributions: list[xr.Dataset], seen: list[str]) -> list[str]:
    """Return the classes that a table has room for, in their order; --json has all of them."""
    largest = {name: max(_share_in(d, name) for d in distributions) for name in seen}
    frequent = sorted(seen, key=lambda name: -largest[name])[:MOST_ROWS]
    return [name for name in seen if name in frequent]


def _share_in(distribution: xr.Dataset, name: str) -> float:
    if name not in distribution["class"].values:
        return 0.0
    return float(distribution["proportion"].sel({"class": name}))


def _share_of(distribution: xr.Dataset, names: list[str]) -> str:
    return _share(sum(_share_in(distribution, name) for name in names))


def _cells(distribution: xr.Dataset, name: str) -> tuple[str, str]:
    if name not in distribution["class"].values:
        return "", ""
    row = distribution.sel({"class": name})
    return _share(row["proportion"]), _range(row["interval_low"], row["interval_high"])


def _complete_cells(distribution: xr.Dataset) -> tuple[str, str]:
    facts = distribution.attrs
    return _share(facts["complete"]), _range(facts["complete_low"], facts["complete_high"])


def _share(value: Any) -> str:
    return f"{float(value):.4f}"


def _range(low: Any, high: Any) -> str:
    return f"{float(low):.4f} to {float(high):.4f}"


def _left_out(result: AssemblyResult) -> list[str]:
    """Return a warning where runs have no outcome."""
    pairs = (("", result.distribution), (" with drawn parameters", result.drawn))
    return [
        f"{found.attrs['left_out']} runs{what} broke down and are left out; use a smaller time step"
        for what, found in pairs
        if found is not None and found.attrs["left_out"]
    ]
