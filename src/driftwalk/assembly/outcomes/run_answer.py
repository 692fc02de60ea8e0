"""The answer of an assembly run, from its datasets or, where it has none, from the runs alone."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from driftwalk.assembly.outcomes.distribution import outcome_distribution
from driftwalk.assembly.outcomes.l1 import l1_distance, l1_noise_floor
from driftwalk.assembly.outcomes.outcome_classes import MOST_BLOCKS
from driftwalk.assembly.outcomes.sizes import assembly_sizes
from driftwalk.assembly.outcomes.survival import class_times as times_of
from driftwalk.model import parse_study
from driftwalk.schema.answers.assembly import assembly_answer

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.schema.answers.parts import Answer


def assembly_run_answer(
    assembly: xr.Dataset,
    *,
    distribution: xr.Dataset | None = None,
    class_times: xr.Dataset | None = None,
    distribution_drawn: xr.Dataset | None = None,
    sizes: xr.Dataset | None = None,
    sizes_drawn: xr.Dataset | None = None,
    steady_state: xr.Dataset | None = None,
    attraction: xr.Dataset | None = None,
) -> Answer:
    """Return the answer of an assembly run.

    Parameters
    ----------
    assembly : xarray.Dataset
        The `assembly` of runs with the parameters of its study.
    distribution, class_times, sizes : xarray.Dataset, optional
        What was made of these runs; what is not given is made of them.
    distribution_drawn, sizes_drawn : xarray.Dataset, optional
        The same of runs with drawn parameters.
    steady_state : xarray.Dataset, optional
        Of the runs, where bonds break.
    attraction : xarray.Dataset, optional
        What acts between two blocks.
    """
    study = parse_study(assembly.attrs["study"])
    forces, confidence = study.forces, study.assembly.confidence
    if distribution is None:
        distribution = outcome_distribution(assembly, confidence=confidence)
    if class_times is None:
        class_times = times_of(assembly, confidence=confidence)
    if sizes is None and int(assembly.attrs["blocks"]) > MOST_BLOCKS:
        sizes = assembly_sizes(assembly, confidence=confidence)
    return assembly_answer(
        distribution,
        times=class_times,
        settings={
            "drag_coefficient": forces.drag_coefficient,
            "force_std_N": forces.force_std_N,
            "approach_resistance_N_s": study.interaction.approach_resistance_N_s,
        },
        drawn=distribution_drawn,
        sizes=sizes,
        sizes_drawn=sizes_drawn,
        steady=steady_state,
        apart=_difference(distribution, distribution_drawn),
        attraction=attraction,
    )


def _difference(found: xr.Dataset, drawn: xr.Dataset | None) -> dict[str, float]:
    """Return how far the two distributions are apart, and how far they would be by chance."""
    if drawn is None:
        return {}
    pair = (found, drawn)
    runs = [int(d.attrs["runs"]) for d in pair]
    counts = Counter[str]()
    for one in pair:
        counts.update(dict(zip(one["class"].values, one["count"].values.tolist(), strict=True)))
    pooled = {name: number / sum(runs) for name, number in counts.items()}
    floor = l1_noise_floor(pooled, *runs)
    return {
        "l1_distance": l1_distance(*pair),
        "l1_noise_floor": floor.mean,
        "l1_noise_floor_95": floor.quantile,
    }
