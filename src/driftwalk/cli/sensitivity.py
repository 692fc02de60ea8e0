"""`driftwalk sensitivity`: how much what blocks build depends on the model."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import numpy as np
import typer

from driftwalk.cli.calibrate import Overwrite, Threads
from driftwalk.cli.inputs.assembly_source import (
    Source,
    load_flow_for,
    refuse_found,
    source_from_calibration,
    source_from_flow,
)
from driftwalk.cli.options.shared import (
    BlockFriction,
    BlockLatching,
    BlockRestitution,
    Blocks,
    Confidence,
    ConnectorAxis,
    ConnectorDistance,
    Depth,
    DragCoefficient,
    FlowFile,
    ForceInterval,
    ForceStd,
    HiddenFaces,
    Json,
    Mass,
    MirrorImages,
    Realisations,
    RunDuration,
    Runs,
    Seed,
    Side,
    StudyFile,
    TankDiameter,
    TimeStep,
    Vary,
    WallFriction,
    WallRestitution,
)
from driftwalk.cli.options.vary import VARY_KEYS, vary_overrides
from driftwalk.cli.terminal.answer import print_warnings
from driftwalk.cli.terminal.output import print_json
from driftwalk.cli.terminal.progress import reported
from driftwalk.cli.terminal.sensitivity_answer import print_answer, summary
from driftwalk.core.study_keys import SENSITIVITY_KEYS, study_overrides

if TYPE_CHECKING:
    from driftwalk.model import Study
    from driftwalk.runs import SensitivityResult

KEYS: Final = {**SENSITIVITY_KEYS, **VARY_KEYS}


def sensitivity(
    out: Annotated[
        Path, typer.Option("--out", "-o", metavar="DIR", help="Run directory to make or continue.")
    ],
    run: Annotated[
        Path | None,
        typer.Argument(
            metavar="RUN", help="Run directory of a finished calibration.", show_default=False
        ),
    ] = None,
    study: StudyFile = None,
    flow: FlowFile = None,
    vary: Vary = None,
    runs: Runs = None,
    realisations: Realisations = None,
    sobol: Annotated[
        int | None,
        typer.Option(
            "--sobol",
            min=8,
            metavar="N",
            help="Base samples for Sobol' indices, a power of two.",
            show_default=False,
        ),
    ] = None,
    blocks: Blocks = None,
    duration: RunDuration = None,
    tank_diameter: TankDiameter = None,
    side: Side = None,
    mass: Mass = None,
    depth: Depth = None,
    drag_coefficient: DragCoefficient = None,
    force_std: ForceStd = None,
    force_interval: ForceInterval = None,
    wall_friction: WallFriction = None,
    wall_restitution: WallRestitution = None,
    time_step: TimeStep = None,
    latching: BlockLatching = None,
    connector_distance: ConnectorDistance = None,
    connector_axis: ConnectorAxis = None,
    hidden_face_drag: HiddenFaces = None,
    chirality: MirrorImages = None,
    block_restitution: BlockRestitution = None,
    block_friction: BlockFriction = None,
    confidence: Confidence = None,
    seed: Seed = None,
    threads: Threads = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Measure how much self-assembly depends on the model.

    Simulates self-assembly at every setting of a map over the drag coefficient and the stochastic
    force, or over the axes that --vary names. Measures how far the outcomes lie from those of a
    reference, which has the parameters of a calibration RUN or of a study (--flow). After a kill,
    the same command continues.
    """
    from driftwalk.runs import SensitivityWork, run_sensitivity

    overrides = study_overrides(
        keys=SENSITIVITY_KEYS,
        runs=runs,
        realisations=realisations,
        blocks=blocks,
        duration=duration,
        tank_diameter=tank_diameter,
        side=side,
        mass=mass,
        depth=depth,
        drag_coefficient=drag_coefficient,
        force_std=force_std,
        force_interval=force_interval,
        wall_friction=wall_friction,
        wall_restitution=wall_restitution,
        time_step=time_step,
        latching=latching,
        connector_distance=connector_distance,
        connector_axis=connector_axis,
        hidden_face_drag=hidden_face_drag,
        chirality=chirality,
        block_restitution=block_restitution,
        block_friction=block_friction,
        confidence=confidence,
        seed=seed,
    ) | vary_overrides(vary or [])
    if run is None:
        source = source_from_flow(study, flow, overrides, keys=KEYS)
    else:
        refuse_found(run, overrides)
        source = source_from_calibration(run, flow, overrides, keys=KEYS, study_file=study)
    named = VARY_KEYS["vary flow"] in overrides
    paths = _flow_paths(source.study, Path() if named or study is None else study.parent)
    work = SensitivityWork(
        study=source.study,
        flow=source.flow,
        flows={name: load_flow_for(path, source.study) for name, path in paths.items()},
        samples=sobol,
        inputs={**source.inputs, **{f"flow {name}": path for name, path in paths.items()}},
        threads=threads,
    )
    with reported("sensitivity") as told:
        result = run_sensitivity(work, out, overwrite=overwrite, **told)
    warnings = [*source.warnings, *_warnings(source, result)]
    if json:
        print_json({**summary(work.study, result), "warnings": warnings})
        return
    print_answer(work.study, result, out)
    print_warnings(warnings)


def _flow_paths(study: Study, folder: Path) -> dict[str, Path]:
    """Return the files of the flow fields; those of a study file are relative to its folder."""
    return {name: folder / name for name in study.sensitivity.flow or ()}


def _warnings(source: Source, result: SensitivityResult) -> list[str]:
    """Return what the user should know about the answer."""
    found = result.sensitivity
    axes = [str(name) for name in found["l1_distance"].dims]
    left_out = int(found["left_out"].sum()) + int(result.reference.attrs["left_out"])
    said: Sequence[tuple[bool, str]] = (
        (
            left_out > 0,
            f"{left_out} runs broke down and are left out; use a smaller time step",
        ),
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
    return [text for holds, text in said if holds]
