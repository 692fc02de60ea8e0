"""Page data: what the report and the live page show of a run, as one JSON object.

In a report the answer stands open, and everything else is folded under the headings of its
chapters.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path, PurePath
from shlex import quote
from typing import TYPE_CHECKING, Any, Final

from driftwalk.core.errors import InputError
from driftwalk.core.progress import ignore_progress
from driftwalk.core.text_files import json_value
from driftwalk.page import parts
from driftwalk.page.html import page_frame
from driftwalk.page.parts import Section, is_simulated
from driftwalk.page.sections.recording import (
    noise_of,
    recording_sections,
    tracking_sections,
    tracking_warnings,
)
from driftwalk.schema import body_names
from driftwalk.schema.answers.citation import bibtex, citation
from driftwalk.schema.check import kind_name, refuse_other_version
from driftwalk.schema.runs import (
    RUN_KINDS,
    RunContents,
    RunKind,
    StoredRun,
    following_of,
    kind_of,
    open_run_folder,
)

if TYPE_CHECKING:
    import xarray as xr


_SHOWN_ONCE: Final = ("trajectory", "flow")
"""Kinds of sections that several runs have in common: what they were made of."""
_BESIDE_CONTENT: Final = ("id", "note", "facts", "run")
"""Keys in which two pages may differ about one thing, such as the noise of a recording."""


def report_page(
    folder: str | Path, *, tell: Callable[[str], None] = ignore_progress
) -> dict[str, Any]:
    """Return the page data of a run directory, finished or not.

    Parameters
    ----------
    folder : path-like
        A run directory of `driftwalk calibrate`, `compare-models`, `fit`, `assemble`,
        `sensitivity` or `study recover`.
    tell : callable
        Called with each sentence that the page says of the files themselves: one that is missing,
        damaged, leads out of the directory or is not the one of the manifest.

    Returns
    -------
    dict
        Plain JSON: format, version, title, state and sections, see ``docs/reference/page-data.md``.
        Missing parts of a run become an empty section with the reason. The same run gives the same
        data.

    Raises
    ------
    InputError
        When there is no run, or a finished one of which nothing can be read.
    RunDirectoryError
        When the directory cannot be read.

    Examples
    --------
    ``[part["title"] for part in report_page("run")["sections"]]``
    """
    run = open_run_folder(Path(folder))
    sections = [] if run.kind is None else _sections_of(run, run.kind)
    if run.state == "finished" and not run.read:
        reason = "; ".join(run.problems.values()) or "it holds no result that driftwalk can show"
        raise InputError(f"{run.folder} holds a finished run, but {reason}")
    words = None
    if run.state != "finished":
        since = run.manifest.get("started_utc")
        begun = "" if since is None else f" It was begun on {since}."
        words = (
            f"This run is not finished.{begun} The same command continues it. This page "
            "shows the results so far."
        )
        state = parts.summary_section([words], [], id="state", title="Not finished")
        sections = [state, *sections]
    remarks = _remarks(run)
    for remark in remarks:
        tell(remark)
    sections = _with_remarks(sections, remarks)
    sections.append(manifest_section(run.manifest))
    found = None if run.kind is None else run.dataset(run.kind.file)
    sections = in_chapters(sections, found, run.name)
    created = run.manifest.get("finished_utc")
    return page_frame(
        "report",
        "Run" if run.kind is None else run.kind.title,
        subtitle=run.name,
        state=_state(words, finished=run.state == "finished"),
        created_utc=None if created is None else str(created),
        sections=sections,
    )


def dataset_page(dataset: xr.Dataset) -> dict[str, Any]:
    """Return the page data of one result that is not in a run directory.

    Parameters
    ----------
    dataset : xarray.Dataset
        A `fit`, `calibration`, `model_calibration`, `model_comparison`, `assembly`, `sensitivity`,
        `recovery` or `model_recovery`.

    Returns
    -------
    dict
        Plain JSON, as of `report_page`. Parts that need another dataset are empty, with the reason.

    Raises
    ------
    InputError
        When it is of another kind.

    Examples
    --------
    ``dataset_page(fit)["title"]``
    """
    dataset = refuse_other_version(dataset)
    kind = kind_of(dataset)
    if kind is None:
        raise InputError(
            f"no page shows a dataset of kind {kind_name(dataset)!r}: give a recording, "
            f"or one of {', '.join(RUN_KINDS)}"
        )
    sections = in_chapters(_sections_of(RunContents({kind.file: dataset}), kind), dataset)
    return page_frame("report", kind.title, state=_state(), sections=sections)


def recording_page(
    trajectory: xr.Dataset, described: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """Return the page data of a recording alone.

    Parameters
    ----------
    trajectory : xarray.Dataset
        A `trajectory`, as from `driftwalk.load`.
    described : mapping, optional
        Result of `driftwalk.describe`: for the tracking, its noise and the warnings.

    Returns
    -------
    dict
        Plain JSON, as of `report_page`.

    Raises
    ------
    InputError
        When the dataset is no trajectory.

    Examples
    --------
    >>> from driftwalk.schema import build_trajectory
    >>> moving = build_trajectory([0.0, 0.1, 0.2], [0.0, 0.01, 0.02], [0.0, 0.0, 0.0])
    >>> [part["kind"] for part in recording_page(moving)["sections"]]
    ['warnings', 'trajectory']
    """
    facts = {} if described is None else described
    names = body_names(trajectory)
    tracking = facts.get("tracking")
    remarks = [parts.SIMULATED] if is_simulated(trajectory) else []
    remarks += [*tracking_warnings(tracking), *(str(text) for text in facts.get("warnings", []))]
    sections = [
        parts.warnings_section(remarks),
        *tracking_sections(tracking),
        *recording_sections(trajectory, noise={name: noise_of(facts, name) for name in names}),
    ]
    source = trajectory.attrs.get("source")
    subtitle = None if source is None else str(source)
    return page_frame("report", "Recording", subtitle=subtitle, state=_state(), sections=sections)


def joined_page(pages: Sequence[Mapping[str, Any]], *, title: str) -> dict[str, Any]:
    """Return one page with the sections of several, such as the runs that belong together.

    A recording or a flow that an earlier page shows too is not repeated; the last page says how to
    cite.

    Parameters
    ----------
    pages : sequence of mapping
        Results of `report_page`, at least one; their subtitles differ.
    title : str
        Of the page.

    Returns
    -------
    dict
        Plain JSON, as of `report_page`. The identifier of a section begins with the subtitle of its
        page; with several pages its ``run`` names that page.

    Raises
    ------
    InputError
        When no page is given, or two have the same subtitle.

    Examples
    --------
    ``joined_page([report_page("fit"), report_page("run")], title="Tank")``
    """
    names = [str(page["subtitle"]) for page in pages]
    if not names or len(set(names)) < len(names):
        raise InputError(f"pages to join need names of their own, got {', '.join(names) or 'none'}")
    shown: list[Section] = []
    sections: list[Section] = []
    for name, page in zip(names, pages, strict=True):
        for part in page["sections"]:
            if part["kind"] in _SHOWN_ONCE:
                content = {key: value for key, value in part.items() if key not in _BESIDE_CONTENT}
                if content in shown:
                    continue
                shown.append(content)
            joined = {**part, "id": f"{name}-{part['id']}"}
            if part["kind"] == "manifest" and page is not pages[-1]:
                joined |= {"cite": None, "bibtex": None}
            if len(names) > 1:
                joined["run"] = f"{page['title']} · {name}"
            if part.get("picture"):
                joined["picture"] = f"{name}-{part['picture']}"
            sections.append(joined)
    words = [str(page["state"]["words"]) for page in pages if page["state"]["words"]]
    finished = all(page["state"]["finished"] for page in pages)
    return page_frame(
        "report",
        title,
        subtitle=", ".join(names),
        state=_state(" ".join(words) or None, finished=finished),
        created_utc=max((one["created_utc"] for one in pages if one["created_utc"]), default=None),
        sections=sections,
    )


def name_apart(pages: Sequence[dict[str, Any]]) -> None:
    """Give pages to join names of their own, where two runs have the same or none.

    Parameters
    ----------
    pages : sequence of dict
        Results of `report_page`, `dataset_page` or `recording_page`; their subtitles change.

    Examples
    --------
    >>> pages = [{"title": "Fit", "subtitle": "run"}, {"title": "Fit", "subtitle": "run"}]
    >>> name_apart(pages)
    >>> [page["subtitle"] for page in pages]
    ['run', 'run 2']
    """
    seen: set[str] = set()
    for page in pages:
        name = str(page["subtitle"] or page["title"].lower())
        others = (f"{name} {number}" for number in itertools.count(2))
        page["subtitle"] = next(one for one in itertools.chain([name], others) if one not in seen)
        seen.add(page["subtitle"])


def manifest_section(manifest: Mapping[str, Any]) -> Section:
    """Return the section on how results were made, and how to cite them.

    Parameters
    ----------
    manifest : mapping
        The manifest of a run, or as much of it as there is.

    Returns
    -------
    dict
        A section of kind "manifest". The study stands in it once.

    Examples
    --------
    >>> manifest_section({"command": "driftwalk demo"})["command"]
    'driftwalk demo'
    """
    from driftwalk import __version__

    specification = manifest.get("specification")
    entries = {key: value for key, value in manifest.items() if key != "command"}
    if isinstance(specification, Mapping):
        same = specification.get("study") == manifest.get("study")
        entries["specification"] = {
            key: value for key, value in specification.items() if not (key == "study" and same)
        }
    software = manifest.get("software")
    known = software.get("driftwalk") if isinstance(software, Mapping) else None
    version = str(known or __version__)
    return parts.section(
        "manifest", "manifest", _REPRODUCE,
        "The command reproduces the same numbers from the same inputs.",
        command=str(manifest.get("command", "")),
        entries=json_value(entries),
        inputs=_inputs(manifest),
        cite=citation(version),
        bibtex=bibtex(version),
    )  # fmt: skip


def _inputs(manifest: Mapping[str, Any]) -> list[dict[str, str]]:
    inputs = manifest.get("inputs")
    if not isinstance(inputs, Mapping):
        return []
    return [
        {
            "role": str(role),
            "name": PurePath(str(facts.get("path", ""))).name,
            "sha256": str(facts.get("sha256", "")),
        }
        for role, facts in inputs.items()
        if isinstance(facts, Mapping)
    ]


def _state(words: str | None = None, *, finished: bool = True) -> dict[str, Any]:
    return {"finished": finished, "progress": 1.0 if finished else None, "words": words}


def _sections_of(run: RunContents, kind: RunKind) -> list[Section]:
    # What data in another form break outside of any section costs the page, and not the program.
    return parts.attempt("summary", parts.FOUND_TITLE, lambda: run.make(kind, kind.page))


def _remarks(run: StoredRun) -> list[str]:
    """Return what a reader has to know of the files themselves."""
    from driftwalk import __version__

    remarks = [f"{problem}: its contents are not shown" for problem in run.problems.values()]
    remarks += run.faults()
    if run.version is not None and run.version != __version__:
        remarks.append(
            f"made by driftwalk {run.version} and shown by {__version__}: the page "
            "may lack results that changed between them"
        )
    if run.kind is None:
        remarks.append("the kind of run is unknown")
    return remarks


def _with_remarks(sections: list[Section], remarks: list[str]) -> list[Section]:
    """Put remarks in front of the warnings of a page, or of the page."""
    if not remarks:
        return sections
    for part in sections:
        if part["id"] == "warnings" and part["kind"] == "warnings":
            part["items"] = [*remarks, *part["items"]]
            part["note"] = None
            return sections
    return [parts.warnings_section(remarks), *sections]


_OPEN: Final = frozenset({"summary", "state", "warnings"})
_REPRODUCE: Final = "How to reproduce this"
_LAW: Final = ("law", "laws", "tested", "stirring", "wall")
_CHAPTERS: Final = {
    **dict.fromkeys(_LAW, "The force law, and what else was tested"),
    **dict.fromkeys(("recording", "tracking"), "The recording"),
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
    made = [{**part, "chapter": _chapter(part["id"])} for part in sections]
    order = list(dict.fromkeys(part["chapter"] for part in made))
    made.sort(key=lambda part: (part["chapter"] is not None, order.index(part["chapter"])))
    for part in made:
        if part["id"] == "summary" and part["kind"] == "summary":
            part["picture"] = _picture(made)
            advice = "" if result is None else following_of(result).advice
            part["next"] = [advice.replace("{run}", quote(name))] if advice else []
    return made


def _chapter(id: str) -> str | None:
    return None if id in _OPEN else _CHAPTERS.get(id.partition("-")[0], "The results in detail")


def _picture(sections: Sequence[Section]) -> str | None:
    """Return the id of the section that shows the result best."""
    shown = [one for one in sections if one["kind"] in _PICTURES]
    best = min(shown, key=lambda one: _PICTURES.index(one["kind"]), default=None)
    return None if best is None else str(best["id"])
