"""The parameters of a calibration in the words of a page."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from driftwalk.page.chart import label as chart_label
from driftwalk.page.parts import axis
from driftwalk.plot.parts.labels import force_interval_text
from driftwalk.schema.answers.facts import facts_of
from driftwalk.schema.parameters import BLOCK, is_block, stored_parameters

if TYPE_CHECKING:
    import xarray as xr


class PageParameter(NamedTuple):
    """A parameter as a page names it."""

    name: str
    """Dimension of the dataset."""
    key: str
    """Flat name of its estimate."""
    unit: str
    label: str
    symbol: str
    """Symbol in formulas; empty for a model of the user."""
    scale: str
    short: str
    """Name in a sentence on the search."""

    @property
    def words(self) -> str:
        """Label and symbol: "drag coefficient C_d"."""
        return f"{self.label} {self.symbol}".rstrip()

    @property
    def short_symbol(self) -> str:
        """The symbol, or the label where there is none."""
        return self.symbol or self.label

    def axis(self, dataset: xr.Dataset, prefix: str = "") -> dict[str, Any]:
        """Return the axis of a map or a chart; the force means nothing without its interval."""
        every = ""
        if self.symbol == FORCE.symbol and "force_interval_s" in facts_of(dataset):
            every = f", {force_interval_text(dataset)}"
        words = f"{self.words}{every}"
        found = axis(self.name, words, self.unit, dataset[f"{prefix}{self.name}"].values)
        if self.scale == "log":
            found |= {"log": chart_label(words, self.unit, log=True)["log"]}
        return found


DRAG = PageParameter(BLOCK[0], "drag_coefficient", "1", "drag coefficient", "C_d", "linear", "drag")
FORCE = PageParameter(
    BLOCK[1], "force_std_N", "N", "stochastic force", "σ_F", "linear", "stochastic force"
)


def page_parameters(calibration: xr.Dataset) -> tuple[PageParameter, ...]:
    """Return the parameters of a calibration, in the order of its dimensions."""
    if is_block(calibration):
        return DRAG, FORCE
    return tuple(
        PageParameter(one.name, one.key, one.unit, one.label, "", one.scale, one.label)
        for one in stored_parameters(calibration)
    )
