"""The chapters of a report: the answer stands open, everything else is folded under a heading."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from shlex import quote
from typing import TYPE_CHECKING, Final

from driftwalk.page.parts import Section

if TYPE_CHECKING:
    import xarray as xr

_OPEN: Final = frozenset({"summary", "state", "warnings"})
_LAW: Final = "The force law, and what else was tested"
_RECORDING: Final = "The recording"
_REPRODUCE: Final = "How to reproduce this"
_DETAILS: Final = "The results in detail"
_CHAPTERS: Final = {
    **dict.fromkeys(("law", "laws", "tested", "stirring", "wall"), _LAW),
    **dict.fromkeys(("recording", "tracking"), _RECORDING),
    "flow": "The flow",
    "check": "Does the model explain the recording?",
    "manifest": _REPRODUCE,
}
"""By the first word of an id; all others are results in detail."""
_PICTURES: Final = ("map", "l1_map", "classes", "flow", "lines", "class_times", "trajectory")
"""Kinds of sections that can be the one picture of an answer, the best one first."""


def in_chapters(
    sections: Iterable[Section], result: xr.Dataset | None = None, name: str = "RUN"
) -> list[Section]:
    """Return the sections of a run by chapters, its answer with a picture and the next step.

    Parameters
    ----------
    sections : iterable of dict
        Sections of one run.
    result : xarray.Dataset, optional
        Its main dataset; without it the answer has no next step.
    name : str
        The run directory, as the next command names it.

    Returns
    -------
    list of dict
        The same sections with the key ``chapter``, None for those that stand open; those of a
        chapter follow each other. The answer gets ``picture``, the id of a section, and ``next``.

    Examples
    --------
    >>> made = in_chapters([{"id": "flow", "kind": "flow"}, {"id": "summary", "kind": "summary"}])
    >>> [(part["id"], part["chapter"], part.get("picture")) for part in made]
    [('summary', None, 'flow'), ('flow', 'The flow', None)]
    """
    made = [{**part, "chapter": _chapter(part)} for part in sections]
    order = list(dict.fromkeys(part["chapter"] for part in made))
    made.sort(key=lambda part: (part["chapter"] is not None, order.index(part["chapter"])))
    for part in made:
        if part["id"] == "summary" and part["kind"] == "summary":
            part["picture"] = _picture(made)
            part["next"] = [] if result is None else _next(result, name)
    return made


def _chapter(part: Section) -> str | None:
    return None if part["id"] in _OPEN else _CHAPTERS.get(part["id"].partition("-")[0], _DETAILS)


def _picture(sections: Sequence[Section]) -> str | None:
    """Return the id of the section that shows the result best."""
    found = [(_PICTURES.index(one["kind"]), one) for one in sections if one["kind"] in _PICTURES]
    return str(min(found, key=lambda pair: pair[0])[1]["id"]) if found else None


def _next(result: xr.Dataset, name: str) -> list[str]:
    """Return what to do after a run: a sentence with a command."""
    from driftwalk.schema.answers.verdict import DOES_NOT_EXPLAIN, stored_verdict
    from driftwalk.schema.runs import kind_of, next_command

    verdict, kind = stored_verdict(result), kind_of(result)
    if verdict is not None and verdict.word == DOES_NOT_EXPLAIN:
        return ["Do not use the numbers yet: first mend what the verdict names."]
    run, following = quote(name), next_command(result)
    if following[:1] == ["assemble"]:
        return [f"Predict what several such bodies build: `driftwalk assemble {run} -o four`"]
    # A model in a file of the reader's own has a name here that need not be one there.
    if following == ["simulate", "motion.nc"]:
        return [f"Simulate the model: `driftwalk simulate {run} -o motion.nc`"]
    if kind is not None and kind.name == "assembly":
        return [f"Learn how fast, and by which steps: `driftwalk kinetics {run} -o kinetics`"]
    if following == ["control test", "test"]:
        return [f"Test it in fresh worlds: `driftwalk control test {run} -o test`"]
    if kind is not None and kind.name == "control_test":
        return [_after_test(result)]
    if kind is not None and kind.name == "yield":
        return [_after_yield(result)]
    return []


def _after_test(test: xr.Dataset) -> str:
    """Return what to do with a policy that was tested."""
    from driftwalk.schema.answers.control import gain_word

    if gain_word(test) == "better":
        return "Follow the policy over what a tracker publishes: `driftwalk control run`"
    constant = test.attrs["constant_mode"]
    return (
        f"Use {constant} all the time, or plan again with more rounds or worlds: "
        "`driftwalk control plan`"
    )


def _after_yield(found: xr.Dataset) -> str:
    """Return what to do after a yield: distinguish the settings, or doubt the model."""
    from driftwalk.schema.answers.yields import more_runs

    more = more_runs(found)
    if more is not None:
        return f"Distinguish the settings: the same command with {more} runs that choose"
    return "See how much it depends on the model: `driftwalk sensitivity RUN -o sensitivity`"
