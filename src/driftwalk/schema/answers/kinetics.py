"""The answer of the kinetics of self-assembly: verdict, model, rates, and the way to a target."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from driftwalk.core.units import in_percent
from driftwalk.schema.answers.facts import sentences
from driftwalk.schema.answers.parts import Answer, Part, Row, Table, each, interval_cells, records
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
        *(rate_table(found, at) for at in range(found.sizes["source"])),
        Row("model", f"{facts['chosen']}, {choice_words(found)}"),
        score_table(found),
    ]
    if "target" in facts:
        parts[:1] = [target_words(found), *parts[:1], target_table(found)]
    if "completion_ks" in facts:
        text = f"{facts['completion_ks']:.3f} (by chance up to {facts['completion_ks_floor']:.3f})"
        parts.append(Row("KS, completion times", text))
    if "equal_p" in facts:
        parts += [Row("equal rates", equal_words(found)), equal_table(found)]
    if "other_blocks_refused" in facts:
        parts.append(str(facts["other_blocks_refused"]))
    elif "other_blocks" in facts:
        rate, error = (facts[f"other_blocks_rate{end}_per_s"] for end in ("", "_standard_error"))
        label = f"first join, {facts['other_blocks']} blocks"
        parts.append(Row(label, f"{rate:.4g} ± {error:.2g} per s, extrapolated"))
    return Answer(parts, _facts(found, reasons), [])


class EqualRatesPolicy(NamedTuple):
    """When the rates of two data sets differ."""

    level: float = 0.05
    """Corrected p-value up to which equal rates are refused: one false alarm in
    twenty comparisons."""


EQUAL_RATES: Final = EqualRatesPolicy()


def equal_words(found: xr.Dataset) -> str:
    """Return whether the rates of two data sets differ, in words."""
    p = float(found.attrs["equal_p"])
    if not math.isfinite(p):
        return "cannot tell: no transition has five events"
    word = "refused" if p <= EQUAL_RATES.level else "not refused"
    return f"{word}: smallest corrected p = {p:.2g}"


def score_table(found: xr.Dataset) -> Table:
    """Return the held-out scores of the candidates."""
    forms = {"score": ".4f", "score_behind": "+.4f", "score_behind_standard_error": ".4f"}
    rows = []
    for one in each(found, "model"):
        numbers = [f"{float(one[name]):{form}}" for name, form in forms.items()]
        rows.append([str(one["model"].values), *numbers])
    return Table(rows, ["model", "held-out ln L per run", "behind the best", "standard error"])


def rate_table(found: xr.Dataset, source: int) -> Table:
    """Return the rates of one data set."""
    share = f"{in_percent(found.attrs['confidence'])} interval"
    rows = [
        [transition_text(one), int(one["count"]), *interval_cells(one, "rate", ".4g")]
        for one in each(found.isel(source=source), "transition")
    ]
    name = "" if found.sizes["source"] == 1 else f"{found['source'].values[source]} data set"
    return Table(rows, ["transition", "seen", "rate (1/s)", share], name)


def choice_words(found: xr.Dataset) -> str:
    """Return why the model was chosen: it is the best, or simpler and about as good."""
    best = str(found["model"].values[int(found["score"].values.argmax())])
    if best == found.attrs["chosen"]:
        return "best on held-out runs"
    return "simplest within one standard error of the best on held-out runs"


def target_words(found: xr.Dataset) -> str:
    """Return how surely and how soon runs reach the target, from where most of them start."""
    one = started(found)
    several = int((found["hidden_start"].sum("hidden") > 0.0).sum()) > 1
    start = f" from {short_class(str(one['class'].values))}" if several else ""
    share, error = (100.0 * float(one[f"committor{end}"]) for end in ("", "_standard_error"))
    time = passage_text(one)
    return (
        f"{short_class(str(found.attrs['target']))} is reached{start} in {share:.1f} ± {error:.1f} "
        f"% of the runs{f', after {time} s on average' if time else ''} (± one standard error)"
    )


def started(found: xr.Dataset) -> xr.Dataset:
    """Return the part of the class in which most runs start."""
    return found.isel({"class": int(found["hidden_start"].sum("hidden").values.argmax())})


def passage_text(one: xr.Dataset) -> str:
    """Return the mean first-passage time of a class with its error, nothing without one."""
    value, error = (float(one[f"passage_time{end}"]) for end in ("", "_standard_error"))
    if not math.isfinite(error):
        return ""
    # Of the error two digits, and of the value the same places.
    places = max(0, 1 - math.floor(math.log10(error))) if error > 0.0 else 0
    return f"{value:.{places}f} ± {error:.{places}f}"


def target_table(found: xr.Dataset) -> Table:
    """Return committors and mean first-passage times from the classes that runs left."""
    left = {str(name).split(" -> ")[0] for name in found["transition"].values}
    rows = [
        [
            short_class(str(one["class"].values)),
            f"{float(one['committor']):.3f} ± {float(one['committor_standard_error']):.3f}"
            if float(one["committor"]) > 0.0
            else "no way seen",
            passage_text(one),
        ]
        for one in each(found, "class")
        if str(one["class"].values) in left - {str(found.attrs["target"])}
    ]
    target = short_class(str(found.attrs["target"]))
    return Table(rows, ["from", f"reaches {target}", "mean first-passage time (s)"])


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
    units = {f"rate{end}": f"rate{end}_per_s" for end in ("", "_low", "_high")}
    rates = tuple(units.values())
    units |= {f"passage_time{end}": f"passage_time{end}_s" for end in ("", "_standard_error")}
    named = found.rename({name: key for name, key in units.items() if name in found})
    errors = ("committor_standard_error", "passage_time_standard_error_s")
    by: dict[str, tuple[str, tuple[str, ...]]] = {
        "transitions": ("transition", ("count", *rates, "equal_p")),
        "models": ("model", ("score", "score_behind", "score_behind_standard_error")),
        "tests": ("test", ("statistic", "statistic_low", "statistic_high", "p", "p_corrected")),
        "classes": ("class", ("committor", "passage_time_s", *errors)),
    }
    tables = {key: records(named, *table) for key, table in by.items()}
    own = {k: v for k, v in found.attrs.items() if k not in ("kind", "schema_version")}
    return {**own, "reasons": reasons, **tables}
