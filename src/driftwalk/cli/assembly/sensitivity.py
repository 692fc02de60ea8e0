"""`driftwalk sensitivity`: how much what blocks build depends on the model."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.cli.inputs.model_source import RUN_NAMES, Source, assembly_source, load_flow_for
from driftwalk.cli.inputs.recordings import opening_note
from driftwalk.cli.inputs.varied import listed, read_varied
from driftwalk.cli.options.run import RunOptions, with_run_options
from driftwalk.cli.options.shared_types import PANEL, FlowFile, Run, optional
from driftwalk.cli.options.study import StudyOptions, with_study_options
from driftwalk.cli.terminal.output import print_prediction
from driftwalk.core.errors import InputError
from driftwalk.core.study_keys import SENSITIVITY_KEYS
from driftwalk.model import declared
from driftwalk.schema.kinds.flow import flow_series_words

if TYPE_CHECKING:
    from driftwalk.model import Study
    from driftwalk.runs import SensitivityResult
    from driftwalk.schema.answers.parts import Answer


AXES: Final = {
    "tank": "sensitivity.tank_diameter_m",
    "blocks": "sensitivity.blocks",
    "flow": "sensitivity.flow",
    "flow-scale": "sensitivity.flow_scale",
    "glued": "sensitivity.glued",
    "latching": "sensitivity.latching",
    "faces": "sensitivity.faces",
    "hidden-face-drag": "sensitivity.hidden_face_drag",
    "stirring-length": "sensitivity.stirring_length_m",
    "bond-rate": "sensitivity.bond_rate_per_s",
    "magnets": "sensitivity.magnets",
    "drag-coefficient": "sensitivity.drag_coefficient",
    "force-std": "sensitivity.force_std_N",
}
"""From an input that can be varied to the key of the study that holds the list of its values."""
VARY_KEYS: Final = {f"vary {name}": key for name, key in AXES.items()}
"""From what an error calls the option to the key that it sets."""


@with_run_options
@with_study_options(SENSITIVITY_KEYS, "runs", "realisations", *RUN_NAMES)
def sensitivity(
    given: StudyOptions,
    run: Run = None,
    flow: FlowFile = None,
    vary: list[str] | None = optional(
        "--vary NAME=VALUES",
        "Values to compare: blocks=2,3,4 or drag-coefficient=0:1.5:0.05. Repeatable.",
        panel=PANEL,
    ),
    sobol: int | None = optional(
        "--sobol N", "Base samples for Sobol' indices, a power of two.", min=8
    ),
    *,
    options: RunOptions,
) -> None:
    """Measure how much self-assembly depends on the model.

    Simulates self-assembly at every setting of a map over the drag coefficient and the stochastic
    force, or over the axes that --vary names. Measures the distance between their outcomes and the
    outcomes of a reference, which has the parameters of a RUN or of a study (--flow). If you stop
    the run, the same command continues it.
    """
    from driftwalk.runs import SensitivityWork

    given = given.and_also(read_varied(vary or [], AXES, listed_values), keys=VARY_KEYS)
    source = assembly_source(run, flow, given)
    paths = flow_paths(source.study, given, run)
    work = SensitivityWork(
        study=source.study,
        flow=source.flow,
        flows={name: load_flow_for(path, source.study) for name, path in paths.items()},
        samples=sobol,
        inputs={**source.inputs, **{f"flow {name}": path for name, path in paths.items()}},
        threads=options.threads,
    )
    begun = opening_note(source.study, given, about="simulation", otherwise=str(run))
    result = options.run(work, "sensitivity", begun=begun, warnings=source.warnings)
    warnings = [*source.warnings, *_warnings(source, result)]
    print_prediction(sensitivity_of(result), options.out, run, warnings, json=options.json)


def sensitivity_of(result: SensitivityResult) -> Answer:
    """Return the answer of a sensitivity study."""
    from driftwalk.assembly import disconnected_alignment
    from driftwalk.schema.answers.sensitivity import sensitivity_answer

    aligned = None
    if result.components is not None:
        # Without it, all classes that vary are of one kind.
        with suppress(InputError):
            aligned = disconnected_alignment(result.components)._asdict()
    return sensitivity_answer(
        result.sensitivity,
        reference=result.reference,
        components=result.components,
        sobol=result.indices,
        aligned=aligned,
    )


def flow_paths(study: Study, given: StudyOptions, run: Path | None) -> dict[str, Path]:
    """Return the files of the flow fields; those of a study file are relative to its folder.

    Raises
    ------
    InputError
        When only the study of a run names them.
    """
    named = VARY_KEYS["vary flow"] in given.overrides
    names = study.sensitivity.flow or ()
    if run is not None and not named and given.file is None and names:
        # A run may be someone else's: it does not say which files of this machine are read.
        raise InputError(
            f"the study of {run} names flow files ({', '.join(names)}): "
            "name the files again, --vary flow=FILE,FILE, or give the study file, --study FILE"
        )
    folder = Path() if named or given.file is None else given.file.parent
    return {name: folder / name for name in names}


def _warnings(source: Source, result: SensitivityResult) -> list[str]:
    """Return what the user should know about the answer."""
    found = result.sensitivity
    axes = [str(name) for name in found["l1_distance"].dims]
    left_out = int(found["left_out"].sum()) + int(result.reference.attrs["left_out"])
    said: Sequence[tuple[bool, str]] = (
        (left_out > 0, f"{left_out} runs broke down and are left out; use a smaller time step"),
        (
            "tank_diameter" in axes
            and float(found["tank_diameter"].min()) < min(source.study.tank.extent_m),
            "all tanks use the same flow field: the wall of a smaller tank cuts it "
            "off and does not change it; to include that effect, give each tank its "
            "own field",
        ),
        (
            "blocks" in axes and bool(np.isnan(found["l1_distance"].values).any()),
            "outcomes with another number of blocks share no class with the "
            "reference: they have no l1 distance",
        ),
        (
            result.components is None,
            "there are no principal components: they need two settings with different outcomes",
        ),
    )
    series = flow_series_words(result.reference.attrs, holds="shares and distances hold")
    return [*series, *(text for holds, text in said if holds)]


def listed_values(key: str, words: list[str]) -> list[Any]:
    """Return the values of a list of [sensitivity]: words, numbers, or those of FROM:TO:STEP.

    Examples
    --------
    >>> listed_values("sensitivity.blocks", ["2:4:1"])
    [2, 3, 4]
    """
    quantity = declared(key).quantity
    if quantity is None:
        return words
    found = listed(words, quantity.unit, known=declared(key).words)
    # The study refuses a part of a block.
    return [int(one) if quantity.whole and one == int(one) else one for one in found]
