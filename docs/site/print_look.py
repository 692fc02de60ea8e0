"""The look of the gallery's pictures: the print style of driftwalk's own figures.

`conf.py` names `reset`, which sphinx-gallery calls before each example.
"""

from __future__ import annotations

from typing import Any, Final

from driftwalk.plot.parts.style import PALETTE, STYLE

PAGE_PX: Final = 736.0
"""Width of the text of a page."""
WIDE_IN: Final = 6.3
"""Width of a figure of two columns (160 mm), which fills the page."""


def reset(_configuration: dict[str, Any], _name: str) -> None:
    """Draw what comes next as driftwalk prints, with letters of one size on all pages."""
    import matplotlib
    from cycler import cycler

    matplotlib.rcdefaults()
    parameters: Any = matplotlib.rcParams
    parameters.update(STYLE)
    parameters["axes.prop_cycle"] = cycler(color=PALETTE)
    parameters["savefig.dpi"] = parameters["figure.dpi"] = PAGE_PX / WIDE_IN
