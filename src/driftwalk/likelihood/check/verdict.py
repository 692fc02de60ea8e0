"""The verdict on a fit: what speaks against the model, and what the recording cannot tell."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import isnan
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from driftwalk.likelihood.check.criteria import Criterion
from driftwalk.likelihood.warnings import meaningless_of
from driftwalk.schema import FLAGS
from driftwalk.schema.answers.facts import facts_of
from driftwalk.schema.answers.parts import undetermined
from driftwalk.schema.answers.verdict import Verdict, verdict_of

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


class PlacePolicy(NamedTuple):
    """How much of the tank a fit has to know; below both limits it knows too little.

    Both count, so that in a large tank a block need not go further than in a small one.
    """

    least_visited: float = 0.08
    """Share of the tank. In two orbits over 4 and 6 % of it C_d came out 41 and 83 % off, and every
    criterion passed."""
    least_blocks: float = 5.0
    """Area in blocks: those orbits covered 2.5 and 3.5, and one along half the radius of the usual
    tank covers 10."""


PLACE: Final = PlacePolicy()


def verdict_on(fit: xr.Dataset, criteria: Sequence[Criterion], *, study: Study) -> Verdict:
    """Return the verdict on a fit from the criteria of its check and from what it says itself."""
    side = study.block.side_m
    unable = [
        *_without_power(criteria),
        *_too_little_seen(fit, side_m=side),
        *_not_determined(fit),
        *meaningless_of(facts_of(fit), side_m=side),
        *_told(fit, "law_unsettled"),
    ]
    return verdict_of([*_told(fit, "flow_shape_change"), *findings_of(criteria)], unable)


def _told(fit: xr.Dataset, attribute: str) -> list[str]:
    """Return what the search of the law has found, as a reason."""
    return [fit.attrs[attribute]] if fit.attrs.get(attribute) else []


def findings_of(criteria: Sequence[Criterion]) -> list[str]:
    """Return the sentences of the criteria that failed, the worst first."""
    failed = [one for one in criteria if one.failed]
    return [one.sentence for one in sorted(failed, key=lambda one: one.p_value)]


def _without_power(criteria: Sequence[Criterion]) -> Iterator[str]:
    for one in criteria:
        if one.powerless and not one.failed:
            yield (
                f"the criterion '{one.name}' has no power: the smallest misfit that it finds is "
                f"{one.detectable:.2g} ({one.words}), and {one.most:.2g} would matter; record for "
                "longer, or over more of the tank"
            )
        if one.name == "steps" and isnan(one.p_value):
            yield "the steps could not be compared with those of simulated recordings"


def _too_little_seen(fit: xr.Dataset, *, side_m: float) -> Iterator[str]:
    """Say where the block has been over too little of the tank, in any of the flows."""
    flags = fit["flag"].values.reshape(-1, *fit["flag"].shape[-2:])
    cell = float(fit["cell_size"]) / side_m
    for flag in flags:
        visited = int(np.count_nonzero(flag == FLAGS["measured"]))
        share = visited / max(int(np.count_nonzero(flag != FLAGS["outside"])), 1)
        if share < PLACE.least_visited and visited * cell**2 < PLACE.least_blocks:
            yield (
                f"the block has been over {share:.0%} of the tank, {visited * cell**2:.1f} times "
                "its own area: the flow, and with it C_d, is not known from so little; record it "
                "on a wider path, with another setting of the pumps"
            )
            return


def _not_determined(fit: xr.Dataset) -> Iterator[str]:
    names = undetermined(fit)
    if names:
        yield (
            f"the recording does not determine {', '.join(sorted(names))}: record for longer, or "
            "in a flow in which the block turns and slips more"
        )
