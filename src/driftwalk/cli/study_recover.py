"""`driftwalk study recover`: how well a set-up gives back a truth that is known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from driftwalk.cli.options.shared import Json, Overwrite, RunFolder
from driftwalk.cli.options.study import StudyOptions, with_study_options
from driftwalk.cli.terminal.output import print_json
from driftwalk.cli.terminal.progress import reported
from driftwalk.core.errors import ConfigurationError
from driftwalk.core.study_keys import RECOVER_KEYS

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study

STATED: Final = ("forces.drag_coefficient", "forces.force_std_N")
"""Parameters with a default that count as the truth only if the file states them."""


@with_study_options(
    RECOVER_KEYS, "flow", "recordings", "duration", "precision", "seed", file="none"
)
def recover(
    truth: Annotated[
        Path,
        typer.Option(
            "--truth", metavar="FILE", help="Study file with the true values and \\[recover]."
        ),
    ],
    out: RunFolder,
    given: StudyOptions,
    threads: Annotated[
        int | None,
        typer.Option(
            "--threads",
            min=1,
            help="Recordings to fit at the same time (default: one per core).",
            show_default=False,
        ),
    ] = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Simulate recordings of known truth, fit them, and report how well the fit recovers the truth.

    Use it to design an experiment: what would recordings of this length, with this camera, in this
    flow reveal? The directory holds recovery.nc, figures and manifest.json. After a kill, the same
    command continues.
    """
    from driftwalk.cli.terminal.recover_answer import print_answer, summary
    from driftwalk.runs import RecoveryWork, run_recovery

    given = replace(given, file=truth)
    chosen = given.study()
    _require_stated(truth)
    named = given.overrides.get(RECOVER_KEYS["flow"])
    field, flow_file = _flow(chosen, truth, None if named is None else Path(named))
    inputs = {"truth": truth, **({} if flow_file is None else {"flow": flow_file})}
    work = RecoveryWork(chosen, field, inputs, threads)
    with reported("recover") as told:
        found = run_recovery(work, out, overwrite=overwrite, **told)
    if json:
        print_json(summary(found))
    else:
        print_answer(found, out)


def _require_stated(path: Path) -> None:
    """Refuse a file in which a true value is only a default."""
    from driftwalk.model import load_study

    study = load_study(path)
    for name in STATED:
        section, _, key = name.partition(".")
        if key not in getattr(study, section).model_fields_set:
            raise ConfigurationError(
                f"{path}: the truth lacks [{section}] {key}: give the true value, a "
                "fitted one or a guess"
            )


def _flow(study: Study, truth: Path, given: Path | None) -> tuple[xr.Dataset | None, Path | None]:
    """Return the true flow field and its file; None where every recording has a random one."""
    from driftwalk.cli.inputs.assembly_source import load_flow_for

    named: Any = study.recover.flow
    if given is None and named in (None, "random"):
        return None, None
    path = given if given is not None else truth.parent / named
    return load_flow_for(path, study), path
