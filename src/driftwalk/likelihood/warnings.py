"""Warnings for the user of a fit, in sentences."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from driftwalk.core.units import in_percent
from driftwalk.likelihood.flow_intervals import Intervals
from driftwalk.likelihood.law.search import LAW
from driftwalk.likelihood.refuse import LENGTH, LIMIT, in_words, needed_duration
from driftwalk.schema.answers.facts import is_open
from driftwalk.schema.outliers import outliers_warning

if TYPE_CHECKING:
    from driftwalk.model import Study
    from driftwalk.model.block import Block


class WarningPolicy(NamedTuple):
    """When a fit warns."""

    least_used: float = 0.9
    """Share of the usable intervals below which what the filter takes is not the whole motion.
    Chosen by hand."""
    least_visited: float = 0.3
    """Share of the tank's nodes below which a fitted flow is mostly made of its prior. Chosen by
    hand."""
    autocorrelation: float = 0.05
    """Least autocorrelation of the innovations that is reported. Chosen by hand."""
    autocorrelation_stds: float = 4.0
    """Standard deviations that the autocorrelation has to be from zero: chance exceeds them once in
    16,000."""
    disagreement_stds: float = 3.0
    """Combined standard deviations between the two estimates of C_d, with the angle in the state
    and as an input, beyond which they do not agree: chance exceeds it once in 370."""
    hidden_drag_width: float = 0.1
    """Half of the interval of the share of hidden drag beyond which a longer recording is asked
    for. Chosen by hand: a tenth of a free face's drag."""
    mirrored_correlation: float = -0.35
    """Correlation of the block's spin with the vorticity of the water below which the fit is
    tried with orientations negated. Chosen by hand: a block turns with the water around it."""


WARNING: Final = WarningPolicy()


def precision_facts(std: float, duration: float, study: Study) -> dict[str, float]:
    """Return what stands in the fit on the precision of C_d."""
    wanted = study.fit.drag_coefficient_precision
    facts = {"drag_coefficient_relative_std": std}
    if wanted is not None:
        facts["drag_coefficient_precision"] = wanted
    facts["needed_duration_s"] = needed_duration(duration, std, wanted or LENGTH.usual_precision)
    return facts


def warnings_of(
    facts: Mapping[str, Any], visited: Sequence[float], intervals: Intervals, *, block: Block
) -> list[str]:
    """Return the warnings; `visited` is the share of the tank that was visited in each flow."""
    return [
        *meaningless_of(facts, block=block),
        *_on_the_data(facts, visited, intervals),
        *_on_the_search(facts),
        *_on_the_model(facts),
        *_on_glued_blocks(facts),
    ]


def meaningless_of(
    facts: Mapping[str, Any],
    *,
    block: Block,
    wall_share: float = LIMIT.most_wall_share,
    lever: float = LAW.notable_lever,
) -> Iterator[str]:
    """Yield the warnings that a number of the fit may mean nothing.

    `wall_share` and `lever`, in sides of the block, are the largest ones without a warning.
    """
    if facts["wall_share"] > wall_share:
        yield (
            f"{in_percent(facts['wall_share'])} of the intervals are at the wall and were "
            "left out: C_d comes from the others alone; record where the block stays away from "
            "the wall"
        )
    left = facts.get("search_left", 0.0)
    if left:
        yield (
            f"the search was given up after {facts['iterations']} steps ([fit] iterations), "
            f"{left:.2g} standard deviations from a maximum of the likelihood: this recording does "
            "not determine the parameters of the model; a motion without random force, as of a "
            "driven body, does not determine them"
        )
    if facts["restricted"] == "no":
        yield (
            "the restricted likelihood has no minimum: C_d comes from the plain "
            "likelihood and is likely too large; the motion says little about C_d or "
            "does not follow the model"
        )
    if facts.get("angle_disagreement_std", 0.0) > WARNING.disagreement_stds:
        yield (
            f"with the angle as an input C_d is {facts['drag_coefficient_angle_given']:.3g}, "
            f"{facts['angle_disagreement_std']:.1f} combined standard deviations away: the turning "
            "of the block and its motion do not follow one drag law, and the intervals are too "
            "narrow"
        )
    # Forces on each of glued blocks make a lever of their own.
    most_m = lever * block.side_m + block.body().force_lever_m()
    if facts.get("force_lever_m_interval", (0.0, 0.0))[0] > most_m:
        yield (
            f"the block turns as if the force acted {1e3 * facts['force_lever_m']:.2g} mm from its "
            "centre: the recorded angle may lag, may not be the angle of the block's faces, or "
            "something else turns the block; C_d and the force may be wrong"
        )


def _on_added_noise(facts: Mapping[str, Any]) -> Iterator[str]:
    position = facts.get("added_position_noise_m", 0.0)
    turning = facts.get("added_orientation_noise_rad", 0.0) if facts["angle"] == "state" else 0.0
    if position:
        also = f" and {math.degrees(turning):.2g}°" if turning else ""
        yield (
            f"the recording has almost no camera noise: {1e3 * position:.2g} mm{also} were added, "
            "because the filter's approximations of the motion are no more exact than this; the "
            "reported noise includes them"
        )


def _on_the_data(
    facts: Mapping[str, Any], visited: Sequence[float], intervals: Intervals
) -> Iterator[str]:
    if facts["outliers"]:
        yield outliers_warning(facts["outliers"], facts["samples"])
    if facts["jumps_removed"]:
        yield (
            f"{facts['jumps_removed']} samples were left out when the recording was read: with "
            "them the body would have been faster than the greatest speed that was given"
        )
    if facts["dropped_frames"]:
        yield (
            f"{facts['dropped_frames']} frames are missing although the time stamps say a constant "
            f"rate, {facts['dropped_places']}: the steps across them are two or more times as long "
            "as their neighbours; their time was put in. Record the time of every frame"
        )
    yield from _on_added_noise(facts)
    used, usable = facts["samples_used"], facts["intervals_usable"]
    if used < WARNING.least_used * usable:
        yield (
            f"the fit used {used} of {usable} intervals only: at the end of the others the body "
            "was more than 6 standard deviations from where the model predicted it; "
            "the fit describes only a part of the motion"
        )
    if "stretches_unsettled" in facts:
        yield facts["stretches_unsettled"]
    std = facts["drag_coefficient_relative_std"]
    wanted = facts.get("drag_coefficient_precision")
    if std > (wanted or LENGTH.usual_precision) and not facts.get("search_left", 0.0):
        # Infinite where the criterion is flat.
        needed = facts["needed_duration_s"]
        length = f"about {in_words(needed)}" if math.isfinite(needed) else "another recording"
        yield (
            f"C_d is known to {100 * std:.2g} % only (one standard deviation) from "
            f"{in_words(facts['duration_s'])}: for "
            f"{100 * (wanted or LENGTH.usual_precision):.3g} % {length} like this would be needed"
        )
    for flow, share in enumerate(visited):
        if share < WARNING.least_visited:
            name = "" if intervals.steady else f"in {intervals.describe_flow(flow)} "
            yield (
                f"{name}the block has been over {in_percent(share)} of the tank only: elsewhere "
                "the flow is continued smoothly and not measured (flag filled)"
            )


def _on_glued_blocks(facts: Mapping[str, Any]) -> Iterator[str]:
    width, most = facts.get("hidden_face_drag_half_width", 0.0), WARNING.hidden_drag_width
    if width > most:
        needed = needed_duration(facts["duration_s"], width, most)
        length = f"about {in_words(needed)}" if math.isfinite(needed) else "another recording"
        yield (
            f"the drag of hidden faces is known to within {width:.2g} only from "
            f"{in_words(facts['duration_s'])}: for {most:.2g} {length} like this would be needed, "
            "or a faster flow along the body"
        )
    apart = facts.get("stirring_misfit_std", 0.0)
    if apart > WARNING.disagreement_stds:
        yield (
            "force and torque on the glued blocks give two different estimates of the stirring "
            f"that they share, {apart:.1f} standard deviations apart: the force on them is of "
            "another kind, or one of the two fits is wrong; do not rely on the correlation and its "
            "length"
        )


def _on_the_search(facts: Mapping[str, Any]) -> Iterator[str]:
    if facts.get("search_left", 0.0):
        return
    if facts["converged"] == "no":
        yield (f"the search has not converged in {facts['iterations']} steps ([fit] iterations)")
    elif is_open(facts, "drag_coefficient"):
        yield (
            "the drag is linear within its uncertainty: the recording does not determine C_d, the "
            "coefficient of the quadratic part"
            if facts.get("drag_law") == "mixed"
            else "the recording constrains C_d less than the prior does (0.5, within a factor of "
            "two): it does not determine C_d"
        )


def _on_the_model(facts: Mapping[str, Any]) -> Iterator[str]:
    if facts["angle"] == "none":
        yield (
            "no orientation was used: the drag is averaged over all orientations of the block, "
            "which made C_d 31 % too small to 6 % too large on recordings of known truth"
        )
    least = WARNING.autocorrelation_stds * facts["autocorrelation_std"]
    if abs(facts["autocorrelation"]) > max(least, WARNING.autocorrelation):
        yield (
            f"the errors of prediction are correlated ({facts['autocorrelation']:+.2f} from one "
            "sample to the next): the motion contains something that the model "
            "lacks, and the intervals are too narrow"
        )
    if is_against_water(facts):
        yield against_water(facts)
    if math.isnan(facts.get("angle_disagreement_std", 0.0)):
        yield (
            "the fit with the angle as an input has no solution, or does not determine C_d, and "
            "was left out: whether the turning of the block and its motion follow one drag law is "
            "not known"
        )


def is_against_water(facts: Mapping[str, Any]) -> bool:
    """Return whether the block seems to turn against the water."""
    return bool(facts.get("spin_correlation", 0.0) < WARNING.mirrored_correlation)


def against_water(facts: Mapping[str, Any]) -> str:
    """Return what is seen of a block that seems to turn against the water."""
    return (
        "the block seems to turn against the water (correlation "
        f"{facts['spin_correlation']:.2f} of its spin with the vorticity of a first estimate of "
        "the flow), as it does where orientations are counted clockwise"
    )
