"""The verdict on a fit: what speaks against the model, and what the recording cannot tell."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import inf, isnan
from typing import TYPE_CHECKING, Final, NamedTuple

from driftwalk.core.units import in_percent
from driftwalk.likelihood.check.criteria import Criterion
from driftwalk.likelihood.result import visited_shares
from driftwalk.likelihood.warnings import meaningless_of
from driftwalk.schema import FLAGS
from driftwalk.schema.answers.facts import facts_of
from driftwalk.schema.answers.parts import undetermined
from driftwalk.schema.answers.verdict import Verdict, verdict_of

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


class InformationPolicy(NamedTuple):
    """When a recording tells too little for a verdict.

    The visited share and area count together, so that in a large tank a block need not go further
    than in a small one. The development set is that of studies/verdict.
    """

    least_visited: float = 0.08
    """Share of the tank, measured (studies/verdict). Not asked of a floating body: its C_d was 0 to
    9 % off in twelve orbits over 2 to 6 % (held-out set). Under the paper's law two orbits over 4
    and 6 % had C_d 41 and 83 % off, and passed every criterion."""
    least_blocks: float = 5.0
    """Area in blocks. Measured: those orbits covered 2.5 and 3.5, and one along half the radius of
    the usual tank covers 10."""
    most_wall_share: float = 0.8
    """Share of the intervals at the wall. Measured: C_d of eight blocks at 62 to 89 % was -10 to
    +21 % off, all within 1.7 standard deviations; at 94 to 98 % three had it 5 to 24 times too
    large (54 recordings of the held-out set at the wall for more than 10 %)."""
    wall_share_in_doubt: float = 0.2
    """Share of the intervals at the wall from which C_d has to be known well. Chosen by hand."""
    most_drag_std_at_wall: float = 0.05
    """Relative standard deviation of C_d up to which it is known well. Measured in those
    recordings: C_d was 0 to 7 % off below it and up to 24 % above, as the standard deviations
    say."""
    most_lever: float = 1 / 30
    """Lever of the force, in sides of the block. Measured: C_d was within 5 % at up to 0.027 of a
    side and more than 85 % off from 0.06 on (development set)."""
    most_drag_std: float = 0.1
    """Relative standard deviation of C_d beyond which the steps have to have power: the errors of
    prediction alone do not settle the model then. Chosen by hand."""


INFORMATION: Final = InformationPolicy()


def verdict_on(fit: xr.Dataset, criteria: Sequence[Criterion], *, study: Study) -> Verdict:
    """Return the verdict on a fit from the criteria of its check and from what it says itself."""
    side, facts = study.block.side_m, facts_of(fit)
    drag_std = float(facts["drag_coefficient_relative_std"])
    failed = sorted((one for one in criteria if one.failed), key=lambda one: one.p_value)
    against = [*_told(fit, "flow_shape_change"), *(one.sentence for one in failed)]
    unable = [
        *_without_power(criteria, drag_std),
        *_too_little_seen(fit, side_m=side),
        *_too_often_at_wall(float(facts["wall_share"]), drag_std),
        *_not_determined(fit),
        *meaningless_of(
            facts,
            block=study.block,
            wall_share=INFORMATION.most_wall_share,
            lever=INFORMATION.most_lever,
        ),
        *_told(fit, "law_unsettled", "flow_modes_unsettled", "stretches_unsettled"),
    ]
    return verdict_of(against, unable)


def _told(fit: xr.Dataset, *attributes: str) -> list[str]:
    """Return what the search of the law has found, as reasons."""
    return [fit.attrs[one] for one in attributes if fit.attrs.get(one)]


def _without_power(criteria: Sequence[Criterion], drag_std: float) -> Iterator[str]:
    for one in criteria:
        settled = one.name == "steps" and drag_std < INFORMATION.most_drag_std
        if one.powerless and not one.failed and not settled:
            yield (
                f"the criterion '{one.name}' has no power: the smallest misfit that it finds is "
                f"{one.detectable:.2g} ({one.words}), and {one.most:.2g} would matter; record for "
                "longer, or over more of the tank"
            )
        if one.name == "steps" and isnan(one.p_value):
            yield "the steps could not be compared with simulated recordings"


def _too_little_seen(fit: xr.Dataset, *, side_m: float) -> Iterator[str]:
    """Say where a block that does not float has been over too little of the tank, in any flow."""
    if fit.attrs["force_law"] == "floating body":
        return
    share = min(visited_shares(fit))
    inside = fit["flag"].isel(flow=0, missing_dims="ignore") != FLAGS["outside"]
    blocks = share * int(inside.sum()) * (float(fit["cell_size"]) / side_m) ** 2
    if share < INFORMATION.least_visited and blocks < INFORMATION.least_blocks:
        yield (
            f"the block has been over {in_percent(share)} of the tank, {blocks:.1f} times its own "
            "area: the flow, and with it C_d, is not known from so little; record it on a wider "
            "path, with another setting of the pumps"
        )


def _too_often_at_wall(share: float, drag_std: float) -> Iterator[str]:
    """Say where C_d is not known well enough for the number of contacts."""
    often = INFORMATION.wall_share_in_doubt < share <= INFORMATION.most_wall_share
    if often and INFORMATION.most_drag_std_at_wall < drag_std < inf:
        yield (
            f"the block was at the wall for {in_percent(share)} of the time, and C_d is known to "
            f"{in_percent(drag_std, decimals=1)} only; record for longer, or where the block stays "
            "away from the wall"
        )


def _not_determined(fit: xr.Dataset) -> Iterator[str]:
    names = undetermined(fit)
    if names:
        yield (
            f"the recording does not determine {', '.join(sorted(names))}: record for longer, or "
            "in a flow in which the block turns and slips more"
        )
