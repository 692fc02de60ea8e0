"""A page's part on bonds that break: shares of time, rates and lifetimes of the classes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from driftwalk.page.parts import Section, chart, label, mark, require, section_of_table, series
from driftwalk.schema.answers.parts import Table
from driftwalk.schema.answers.steady_state import steady_parts, steady_words
from driftwalk.schema.shapes import short_class

if TYPE_CHECKING:
    import xarray as xr

MOST_CURVES = 8
"""Classes whose lifetimes are drawn, those with the most time."""


def steady_sections(steady: xr.Dataset) -> list[Section]:
    """Return the table of the classes, and the survival of those with the most time.

    Parameters
    ----------
    steady : xarray.Dataset
        A `steady_state`.

    Raises
    ------
    InputError
        When it has no shares or no survival.
    """
    require(steady, "class", "time_share", "age", "survival", "class_time")
    table = next(part for part in steady_parts(steady) if isinstance(part, Table))
    note = f"{table.title[0].upper()}{table.title[1:]}. {steady_words(steady).capitalize()}."
    time = np.where(
        np.isfinite(steady["survival"].values).any(axis=0), steady["class_time"].values, 0.0
    )
    drawn = []
    for place in np.argsort(-time, kind="stable")[:MOST_CURVES].tolist():
        if time[place] > 0:
            one = steady.isel({"class": place})
            ends = (one["survival_low"].values, one["survival_high"].values)
            name = short_class(str(one["class"].values))
            drawn.append(series(name, steady["age"].values, one["survival"].values, ends=ends))
    return [
        section_of_table("steady-state", "Steady state", table, note),
        chart(
            "lifetimes", "Lifetimes of the classes",
            "Kaplan-Meier, censored at the end of a run; a stay ends with a joining or a parting.",
            x=label("time since the class formed", "s"), y=label("share that lasts longer"),
            series=drawn, marks=[mark("half of the stays", y=0.5)],
        ),
    ]  # fmt: skip
