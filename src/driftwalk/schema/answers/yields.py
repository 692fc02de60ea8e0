"""The answer of a maximised yield: the best setting, those like it, and the front over time."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.core.units import in_percent
from driftwalk.schema.answers.parts import Answer, Following, Part, Row, Table, interval_cells
from driftwalk.schema.answers.sensitivity import key_of
from driftwalk.schema.kinds.sensitivity import AXES, axis_number
from driftwalk.schema.shapes import short_class

if TYPE_CHECKING:
    import xarray as xr

NAMES: Final = tuple(one.name for one in AXES)
LISTED: Final = 12
"""Settings of a table; a search has more; chosen by hand."""
NAMED: Final = 4
"""Settings that a sentence names, next to the best; chosen by hand."""
NUMBERS: Final = (
    *("runs", "reached", "fresh_runs"),
    *(f"{name}{end}" for name in ("fresh_yield", "difference") for end in ("", "_low", "_high")),
)


def yield_answer(found: xr.Dataset) -> Answer:
    """Return the answer of a `yield`.

    Parameters
    ----------
    found : xarray.Dataset
        A `yield`.
    """
    facts = found.attrs
    best = int(facts["best"])
    parts: list[Part] = [
        f"{found.sizes['setting']} settings compared by {facts['chosen_runs']} runs on shared "
        f"random numbers; yields from {facts['reported_runs']} fresh runs",
        Row("best setting", setting_words(found, best)),
        Row(f"yield of {short_class(str(facts['target']))}", yield_words(found, best)),
        *standing_sentences(found),
        setting_table(found),
        front_table(found),
    ]
    broken = (
        f"{facts['left_out']} runs broke down and count as without the target; use a smaller time "
        "step"
    )
    return Answer(parts, _facts(found), [broken] if facts["left_out"] else [])


def varied(found: xr.Dataset) -> list[str]:
    """Return the names of the axes that vary."""
    return [name for name in NAMES if name in found]


def value_text(name: str, value: Any) -> str:
    """Return a value of an axis in the unit of a reader.

    Examples
    --------
    >>> value_text("force_std", 0.00055), value_text("latching", "collision")
    ('0.55 mN', 'collision')
    """
    if isinstance(value, str):
        return value
    number = axis_number(name)
    return f"{number.factor * float(value):.4g} {number.reader_unit}".rstrip()


def setting_words(found: xr.Dataset, at: int) -> str:
    """Return the values of a setting, see `point_words`."""
    return point_words({name: found[name].values[at] for name in varied(found)})


def point_words(point: Mapping[str, Any]) -> str:
    """Return the values of a setting by what a reader calls them.

    Examples
    --------
    >>> point_words({"flow_scale": 1.5, "force_std": 0.0012})
    'strength of the flow 1.5, σ_F = 1.2 mN'
    """
    numbers = {name: axis_number(name) for name in point}
    return ", ".join(
        f"{one.short}{' =' if one.symbol else ''} {value_text(name, point[name])}"
        for name, one in numbers.items()
    )


def yield_words(found: xr.Dataset, at: int) -> str:
    """Return the yield of a setting with its exact interval, and of how many fresh runs."""
    one = found.isel(setting=at)
    share, ends = interval_cells(one, "fresh_yield", ".3f")
    return (
        f"{share} by {found.attrs['by_s']:g} s   {in_percent(found.attrs['confidence'])} interval "
        f"{ends}   {int(one['fresh_runs'])} fresh runs"
    )


def standing_sentences(found: xr.Dataset) -> list[str]:
    """Return whether the best was distinguished from the others, in words."""
    alike = np.flatnonzero(found["standing"].values == "alike")
    facts = found.attrs
    if not alike.size:
        return [f"every other setting is worse, with {in_percent(facts['confidence'])} confidence"]
    first = f"these {alike.size + 1} cannot be distinguished within {100 * facts['within']:.2g} %: "
    order = alike[np.argsort(-(found["reached"] / found["runs"]).values[alike], kind="stable")]
    named = "; ".join(setting_words(found, int(at)) for at in (facts["best"], *order[:NAMED]))
    more = f"; and {order.size - NAMED} more" if order.size > NAMED else ""
    said = [first + named + more]
    kept = found.isel(setting=[int(facts["best"]), *alike])
    spans = [
        f"{axis_number(name).short} {value_text(name, kept[name].min())} to "
        f"{value_text(name, kept[name].max())}"
        for name in str(facts["searched"]).split(", ")
        if name
    ]
    if spans:
        said.append(f"of the ranges they take {', '.join(spans)}")
    if (needed := more_runs(found)) is not None:
        said.append(
            f"to distinguish them within {100 * facts['indifference']:.2g} %, give more runs "
            f"(`selection_runs={needed}`)"
        )
    return said


def more_runs(found: xr.Dataset) -> int | None:
    """Return how many runs of halving distinguish within the indifference; None where these do.

    The reached difference falls with the square root of the runs; one digit, rounded up.
    """
    facts = found.attrs
    if "selection_runs" not in facts or facts["within"] <= 1.001 * facts["indifference"]:
        return None
    needed = facts["selection_runs"] * (facts["within"] / facts["indifference"]) ** 2
    digit = 10 ** math.floor(math.log10(needed))
    return int(math.ceil(needed / digit) * digit)


def after_yield(found: xr.Dataset) -> Following:
    """Return what comes after a yield: distinguish the settings, or doubt the model."""
    if (more := more_runs(found)) is not None:
        return Following(
            advice=f"Distinguish the settings: the same command with {more} runs that choose"
        )
    return Following(
        advice="See how much it depends on the model: `driftwalk sensitivity RUN -o sensitivity`"
    )


def setting_table(found: xr.Dataset) -> Table:
    """Return the settings, the best ones first."""
    share = (found["reached"] / found["runs"]).values
    rank = [("best", "alike", "worse").index(word) for word in found["standing"].values]
    order = sorted(range(share.size), key=lambda at: (rank[at], -share[at]))
    rows = []
    for at in order[:LISTED]:
        one = found.isel(setting=at)
        words, standing = setting_words(found, at), str(one["standing"].values)
        numbers = [*interval_cells(one, "fresh_yield", ".3f"), f"{share[at]:.3f}", int(one["runs"])]
        rows.append([words, *numbers, standing.replace("alike", "cannot be distinguished")])
    share_words = f"{in_percent(found.attrs['confidence'])} interval"
    columns = ["setting", "yield", share_words, "share in the choosing runs", "runs", "standing"]
    title = f"the best {LISTED} of {len(order)} settings" if len(order) > LISTED else ""
    return Table(rows, columns, title)


def front_table(found: xr.Dataset) -> Table:
    """Return the front of yield and time: where the best setting changes, and the yields there."""
    front = found["front_setting"].values
    last = len(front) - 1
    rows = []
    for at in range(last // 10, last + 1, max(last // 10, 1)):
        time, cells = (
            float(found["time"][at]),
            interval_cells(found.isel(time=at), "front_yield", ".3f"),
        )
        rows.append([f"{time:g}", *cells, setting_words(found, int(front[at]))])
    share_words = f"{in_percent(found.attrs['confidence'])} interval"
    return Table(rows, ["time (s)", "yield", share_words, "setting"], "front of yield and time")


def _facts(found: xr.Dataset) -> dict[str, Any]:
    own = {k: v for k, v in found.attrs.items() if k not in ("kind", "schema_version", "best")}
    settings = _rows(
        {
            **{key_of(name): found[name] for name in varied(found)},
            **{name: found[name] for name in (*NUMBERS, "standing")},
        }
    )
    front = _rows(
        {
            "time_s": found["time"],
            "setting": found["front_setting"],
            **{f"yield{end}": found[f"front_yield{end}"] for end in ("", "_low", "_high")},
        }
    )
    return {**own, "best": settings[int(found.attrs["best"])], "settings": settings, "front": front}


def _rows(columns: Mapping[str, xr.DataArray]) -> list[dict[str, Any]]:
    rows = zip(*(one.values for one in columns.values()), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in rows]
