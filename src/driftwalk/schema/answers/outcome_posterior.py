"""The answer of parameters from outcomes alone: intervals, the self-check, what other data tell."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from driftwalk.core.units import in_percent
from driftwalk.schema.answers.facts import sentences
from driftwalk.schema.answers.parts import Answer, Estimate, Part, Row, Table, each, records
from driftwalk.schema.description import Number
from driftwalk.schema.kinds.sensitivity import AXIS_NUMBERS, axis_number
from driftwalk.schema.shapes import short_class

if TYPE_CHECKING:
    import xarray as xr


REFUSED: Final = "cannot tell: the model does not explain the outcomes"
"""The verdict on a model with which the outcomes do not agree."""
BOTH_ENDS: Final = "both"
UPPER_END: Final = "upper"
LOWER_END: Final = "lower"
NO_END: Final = "none"
"""Ends of an interval that are limits, and not those of the range."""


def outcome_posterior_answer(found: xr.Dataset) -> Answer:
    """Return the answer of an `outcome_posterior`.

    Parameters
    ----------
    found : xarray.Dataset
        An `outcome_posterior`.
    """
    facts = found.attrs
    reasons = sentences(found, "reason")
    parts: list[Part] = [
        f"{facts['runs']} runs of {facts['blocks']} blocks, classes after {facts['after_s']:g} s; "
        f"{found.sizes['node']} nodes of {facts['node_runs']} simulated runs",
        Row("verdict", str(facts["verdict"])),
        *(_estimate(one, float(facts["confidence"])) for one in each(found, "parameter")),
        *reasons,
    ]
    if facts["used"] != "none":
        parts.append(Row("inferred from", f"{facts['used']}; {agreement(found)}"))
    parts += [class_table(found), data_table(found)]
    return Answer(parts, _facts(found, reasons), [])


def number_of(one: xr.Dataset) -> Number:
    """Return the name of a parameter, and its unit for a reader."""
    name, unit = (str(one[key].values) for key in ("parameter", "unit"))
    return AXIS_NUMBERS.get(name, Number(name, unit))


def _estimate(one: xr.Dataset, confidence: float) -> Part:
    """Return the estimate of a parameter with its interval, or what else the data say of it."""
    number = number_of(one)
    if not bool(one["determined"]):
        return Row(number.words, limit_words(one, confidence))
    low, high = (float(end) for end in one["interval"].values)
    return Estimate(number, float(one["estimate"]), (low, high), confidence)


def condition(found: xr.Dataset) -> str:
    """Return under what condition a posterior holds whose model is refused; else nothing."""
    if found.attrs["verdict"] != REFUSED:
        return ""
    p = float(found.attrs["p"])
    return f"if the model were right (the outcomes refuse it, p = {p:.2g})"


def limit_words(one: xr.Dataset, confidence: float) -> str:
    """Return a limit from one side, such as "below 0.39 mN (90 %)", or that data cannot tell."""
    number, side = number_of(one), str(one["limit"].values)
    low, high = (number.factor * float(end) for end in one["interval"].values)
    unit = f" {number.reader_unit}".rstrip()
    if side == UPPER_END:
        return f"below {high:.4g}{unit} ({100 * confidence:.0f} %)"
    if side == LOWER_END:
        return f"above {low:.4g}{unit} ({100 * confidence:.0f} %)"
    low, high = (number.factor * float(one[end]) for end in ("low", "high"))
    return f"cannot tell: between {low:.4g} and {high:.4g}{unit}"


def agreement(found: xr.Dataset) -> str:
    """Return how well the model agrees with the outcomes, and how precise the emulator is."""
    return (
        f"p = {float(found.attrs['p']):.2g} that simulated runs agree no better; emulator's error "
        f"{in_percent(float(found.attrs['emulator_noise']))} of the sampling error"
    )


def class_table(found: xr.Dataset) -> Table:
    """Return the observed classes, and the shares that the posterior predicts."""
    rows = [
        [
            short_class(name) if (name := str(one["class"].values)) != "rest" else name,
            int(one["count"]),
            f"{int(one['count']) / max(int(found.attrs['runs']), 1):.3f}",
            f"{float(one['share']):.3f}",
        ]
        for one in each(found, "class")
    ]
    return Table(rows, ["class", "runs", "share", "predicted"])


def data_table(found: xr.Dataset) -> Table:
    """Return the coverage and the expected interval widths of each kind of data."""
    truths = int(found.attrs["truths"])
    names = [str(name) for name in found["parameter"].values]
    rows = [
        [
            str(one["data"].values),
            f"{round(truths * float(one['coverage']))} of {truths}",
            f"{float(one['power']):.1f}" if bool(one["offered"]) else "not offered",
            *(in_percent(float(width)) for width in one["expected_width"].values),
            "yes" if bool(one["observed"]) else "",
        ]
        for one in each(found, "data")
    ]
    widths = [f"{axis_number(name).plain}: interval" for name in names]
    columns = ["what is seen of each run", "truths held", "power", *widths, "given"]
    return Table(rows, columns, "information in each kind of data (intervals over the prior's)")


def _facts(found: xr.Dataset, reasons: list[str]) -> dict[str, Any]:
    parameters = {}
    for one in each(found, "parameter"):
        number = number_of(one)
        known, side = bool(one["determined"]), str(one["limit"].values)
        low, high = one["interval"].values.tolist()
        parameters[number.key] = {
            "estimate": float(one["estimate"]) if known else None,
            "interval": [
                low if side in (BOTH_ENDS, LOWER_END) else None,
                high if side in (BOTH_ENDS, UPPER_END) else None,
            ],
            "determined": known,
            "limit": side,
            "range": [float(one["low"]), float(one["high"])],
        }
    seen = ("observed", "offered", "power", "coverage")
    shares = ("interval_coverage", "expected_width", "width")
    data = records(found, "data", (*seen, *shares))
    classes = records(found.rename(share="predicted"), "class", ("count", "predicted"))
    own = {k: v for k, v in found.attrs.items() if k not in ("kind", "schema_version", "study")}
    return {
        **own, "reasons": reasons, "parameters": parameters, "data": data, "classes": classes
    }  # fmt: skip
