"""The answer of the kinetics of self-assembly: verdict, model, rates, and the way to a target."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from driftwalk.schema.answers.facts import sentences
from driftwalk.schema.answers.parts import Answer, Part, Row, Table, each
from driftwalk.schema.shapes import short_class

if TYPE_CHECKING:
    import xarray as xr


def kinetics_answer(found: xr.Dataset) -> Answer:
    """Return the answer of a `kinetics`.

    Parameters
    ----------
    found : xarray.Dataset
        A `kinetics`.
    """
    facts = found.attrs
    reasons = sentences(found, "reason")
    parts: list[Part] = [
        f"{facts['runs']} runs of {facts['blocks']} blocks, {facts['joins']} changes of class in "
        f"{facts['duration_s']:g} s at most",
        Row("verdict", str(facts["verdict"])),
        *reasons,
        Row("model", f"{facts['chosen']}, chosen on held-out runs"),
        score_table(found),
        *(rate_table(found, at) for at in range(found.sizes["source"])),
    ]
    if "completion_ks" in facts:
        text = f"{facts['completion_ks']:.3f} (by chance up to {facts['completion_ks_floor']:.3f})"
        parts.append(Row("KS, completion times", text))
    if "target" in facts:
        parts.append(target_table(found))
    if "equal_p" in facts:
        parts += [Row("equal rates", equal_words(found)), equal_table(found)]
    if "other_blocks_refused" in facts:
        parts.append(str(facts["other_blocks_refused"]))
    elif "other_blocks" in facts:
        rate, error = (facts[f"other_blocks_rate{end}_per_s"] for end in ("", "_standard_error"))
        label = f"first join, {facts['other_blocks']} blocks"
        parts.append(Row(label, f"{rate:.4g} ± {error:.2g} per s, extrapolated"))
    return Answer(parts, _facts(found, reasons), [])


def equal_words(found: xr.Dataset) -> str:
    """Return whether the rates of two data sets differ, in words."""
    p = float(found.attrs["equal_p"])
    if not math.isfinite(p):
        return "cannot tell: no transition has five events"
    word = "refused" if p <= 0.05 else "not refused"
    return f"{word}: smallest corrected p = {p:.2g}"


def score_table(found: xr.Dataset) -> Table:
    """Return the held-out scores of the candidates."""
    rows = [
        [
            str(one["model"].values),
            f"{float(one['score']):.4f}",
            f"{float(one['score_behind']):+.4f}",
            f"{float(one['score_behind_standard_error']):.4f}",
        ]
        for one in each(found, "model")
    ]
    return Table(rows, ["model", "held-out ln L per run", "behind the best", "standard error"])


def rate_table(found: xr.Dataset, source: int) -> Table:
    """Return the rates of one data set."""
    share = f"{found.attrs['confidence']:.0%} interval"
    rows = [
        [
            transition_text(one),
            int(one["count"]),
            f"{float(one['rate']):.4g}",
            f"{float(one['rate_low']):.4g} to {float(one['rate_high']):.4g}",
        ]
        for one in each(found.isel(source=source), "transition")
    ]
    name = "" if found.sizes["source"] == 1 else f"{found['source'].values[source]} data set"
    return Table(rows, ["transition", "seen", "rate [1/s]", share], name)


def target_table(found: xr.Dataset) -> Table:
    """Return committors and mean first-passage times."""
    rows = [
        [
            short_class(str(one["class"].values)),
            f"{float(one['committor']):.3f} ± {float(one['committor_standard_error']):.3f}",
            f"{float(one['passage_time']):.4g} ± {float(one['passage_time_standard_error']):.2g}"
            if math.isfinite(float(one["passage_time"]))
            else "",
        ]
        for one in each(found, "class")
    ]
    target = short_class(str(found.attrs["target"]))
    return Table(rows, ["from", f"reaches {target}", "mean first-passage time [s]"])


def equal_table(found: xr.Dataset) -> Table:
    """Return the tests of equal rates."""
    rows = [
        [
            transition_text(one),
            *(int(count) for count in one["count"].values),
            *(
                f"{float(one[name]):.2g}" if math.isfinite(float(one[name])) else ""
                for name in ("equal_p", "equal_p_corrected")
            ),
        ]
        for one in each(found, "transition")
    ]
    return Table(rows, ["transition", "first", "second", "p", "corrected"])


def transition_text(one: xr.Dataset) -> str:
    """Return a transition with short names of its classes."""
    return " -> ".join(short_class(name) for name in str(one["transition"].values).split(" -> "))


def _facts(found: xr.Dataset, reasons: list[str]) -> dict[str, Any]:
    by: dict[str, Any] = {
        "transitions": ("transition", ("count", "rate", "rate_low", "rate_high", "equal_p")),
        "models": ("model", ("score", "score_behind", "score_behind_standard_error")),
        "tests": ("test", ("statistic", "statistic_low", "statistic_high", "p", "p_corrected")),
        "classes": ("class", ("committor", "passage_time")),
    }
    units = {"rate": "rate_per_s", "rate_low": "rate_low_per_s", "rate_high": "rate_high_per_s"}
    units["passage_time"] = "passage_time_s"
    tables = {
        key: [
            {
                dim: str(one[dim].values),
                **{units.get(name, name): one[name].values for name in names if name in one},
            }
            for one in each(found, dim)
        ]
        for key, (dim, names) in by.items()
    }
    own = {k: v for k, v in found.attrs.items() if k not in ("kind", "schema_version")}
    return {**own, "reasons": reasons, **tables}
