"""The answer of a result of any kind: what the terminal, a notebook, a page and JSON show."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

from driftwalk.schema.answers.assembly import assembly_answer
from driftwalk.schema.answers.calibration import calibration_answer, model_calibration_answer
from driftwalk.schema.answers.fit import fit_answer
from driftwalk.schema.answers.model_comparison import comparison_answer
from driftwalk.schema.answers.parts import Answer
from driftwalk.schema.answers.recovery import model_recovery_answer, recovery_answer
from driftwalk.schema.answers.sensitivity import sensitivity_answer

if TYPE_CHECKING:
    import xarray as xr

_ANSWERS: Final[dict[str, Callable[..., Answer]]] = {
    "fit": fit_answer,
    "calibration": calibration_answer,
    "model_calibration": model_calibration_answer,
    "model_comparison": comparison_answer,
    "recovery": recovery_answer,
    "model_recovery": model_recovery_answer,
    "outcome_distribution": assembly_answer,
    "sensitivity": sensitivity_answer,
}
"""By kind of dataset; a new kind has a function like these, and an entry here."""


def answer_of(found: xr.Dataset, **more: Any) -> Answer | None:
    """Return the answer of a result; None where its kind has none.

    Parameters
    ----------
    found : xarray.Dataset
        The main dataset of a run.
    **more
        What else the run made: ``check`` of a fit; ``times``, ``drawn``, ``sizes`` of an assembly;
        ``reference``, ``components``, ``indices`` of a sensitivity study.

    Examples
    --------
    >>> import xarray as xr
    >>> from driftwalk.schema.answers.parts import lines_of
    >>> names = {"parameter": ["drag_coefficient"], "unit": ("parameter", ["1"])}
    >>> values = {"estimate": ("parameter", [0.4]), "confidence": 0.9}
    >>> values["interval"] = (("parameter", "bound"), [[0.38, 0.42]])
    >>> answer = answer_of(xr.Dataset(values, names, {"kind": "fit"}))
    >>> lines_of(answer.parts)
    ['drag coefficient C_d   0.4000   90% interval 0.3800 to 0.4200']
    """
    make = _ANSWERS.get(str(found.attrs.get("kind")))
    return None if make is None else make(found, **more)
