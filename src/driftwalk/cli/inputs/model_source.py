"""Where a command takes its model from: a finished run, or a study and a flow field."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from driftwalk.cli.options.study import StudyOptions, option_name
from driftwalk.cli.terminal.argument_names import to_options
from driftwalk.cli.terminal.output import print_note
from driftwalk.core.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.core.arrays import Floats
    from driftwalk.model import Study
    from driftwalk.motion import MotionModel
    from driftwalk.runs import FoundRun


SEARCHED: Final = ("forces.drag_coefficient", "forces.force_std_N")
"""Parameters that a run finds: a study file may hold any value for them."""
FOUND_BY_A_RUN: Final = (*SEARCHED, "forces.force_interval_s")
TANK_DIAMETER: Final = "tank.diameter_m"
TABLE: Final = "interaction.attraction"
CONNECTOR: Final = ("assembly.connector_distance_m", "assembly.connector_axis_rad")
"""Parameters of the latching rule "connector" alone."""
RUN_NAMES: Final = (
    *("blocks", "duration", "tank_diameter", "body_shape", "side", "mass", "depth"),
    *("drag_coefficient", "force_std", "force_interval"),
    *("wall_friction", "wall_restitution", "time_step"),
    *("latching", "connector_distance", "connector_axis", "faces", "glued", "hidden_face_drag"),
    "chirality",
    *("stirring_length", "stirring"),
    *("bond_rate", "bond_strength", "relatch_clearance"),
    *("magnets", "magnet_inset", "poles", "attraction", "capillary", "meniscus_height"),
    "approach_resistance",
    *("block_restitution", "block_friction", "confidence", "seed", "flow_repeat", "flow_start"),
)
"""Options for keys of a study that every command on self-assembly takes."""
MODEL_KEYS: Final = ("block", "tank", "water", "forces", "simulation.time_step_s")
"""Sections that a study file must not contradict when a run gives the model."""


@dataclass(frozen=True)
class Source:
    """The model and its source.

    Attributes
    ----------
    study : Study
        The study with the options over it.
    flow : xarray.Dataset
        The flow field.
    uncertainty : xarray.Dataset or None
        The fit or calibration where parameters can be drawn from it.
    inputs : dict of str to Path
        The files that were read, by their role.
    warnings : list of str
        Warnings for the user.
    not_drawn : str or None
        Why no parameters can be drawn from a run, None where they can or there is no run.
    first_force : str or None
        The one of `warnings` that does not hold where each flow of a fit has its own σ_F.
    """

    study: Study
    flow: xr.Dataset
    uncertainty: xr.Dataset | None
    inputs: dict[str, Path]
    warnings: list[str]
    not_drawn: str | None = None
    first_force: str | None = None


def assembly_source(
    run: Path | None, flow_file: Path | None, given: StudyOptions, *, refused: Sequence[str] = ()
) -> Source:
    """Return the model of a run, or of a study in a flow field.

    Raises
    ------
    InputError
        When a run is given with an option for what it has found, or with one that is `refused`;
        when there is no flow field, or a file or option is wrong.
    """
    if run is None:
        return _source_from_flow(_with_table(given), flow_file)
    refuse_found(run, given.overrides, also=refused)
    return _source_from_run(run, flow_file, _with_table(given))


def _with_table(given: StudyOptions) -> StudyOptions:
    """Return the options with the study file's table of attraction, relative to its folder."""
    from driftwalk.model import load_study

    if given.file is None or TABLE in given.overrides:
        return given
    name = load_study(given.file).interaction.attraction
    if name is None:
        return given
    return given.and_also({TABLE: str(given.file.parent / name)}, keys=given.keys)


def given_files(**roles: Path | None) -> dict[str, Path]:
    """Return the files that were given, by their roles."""
    return {role: path for role, path in roles.items() if path is not None}


def _table_of(study: Study) -> dict[str, Path]:
    """Return the file of the table of attraction by its role, none where there is no table."""
    name = study.interaction.attraction
    return given_files(attraction=None if name is None else Path(name))


def _source_from_flow(given: StudyOptions, flow_file: Path | None) -> Source:
    """Return the model of a study, in a flow field from a file."""
    from driftwalk.conditions import unstated_warning

    if flow_file is None:
        raise InputError(
            "the flow of the water is missing: give the run directory of a fit or a calibration, "
            "or a flow field (--flow)"
        )
    chosen = given.study()
    unstated = unstated_warning(chosen, about="simulation")
    field, stretched = _in_tank(load_flow_for(flow_file, chosen), given, chosen)
    said = [*filter(None, [unstated]), *_without_effect(given, chosen), *stretched]
    inputs = given_files(flow=flow_file, study=given.file) | _table_of(chosen)
    return Source(chosen, field, None, inputs, said)


def _in_tank(field: xr.Dataset, given: StudyOptions, study: Study) -> tuple[xr.Dataset, list[str]]:
    """Return a field, stretched to a larger tank that an option states, and a warning of it."""
    from driftwalk.flow import stretch_flow

    wanted = study.tank.diameter_m
    arena = json.loads(field.attrs.get("arena", "{}"))
    own = arena.get("diameter_m") if arena.get("shape") == "circle" else None
    if TANK_DIAMETER not in given.overrides or wanted is None or own is None or wanted <= own:
        return field, []
    said = (
        f"the flow was measured in a tank of {own:g} m, and is stretched to {wanted:g} m: the same "
        "speeds at the same shares of the radius, which is an assumption; to state another flow, "
        "give --flow FILE"
    )
    return stretch_flow(field, diameter=wanted), [said]


def _without_effect(given: StudyOptions, study: Study) -> list[str]:
    """Return warnings of options that describe what no block has."""
    rules, pull, varied = study.assembly, study.interaction, study.sensitivity
    needs = (
        (
            CONNECTOR,
            rules.latching == "connector" or "connector" in (varied.latching or ()),
            f"with --latching {rules.latching}: blocks have connectors with --latching connector",
        ),
        (
            ("interaction.magnet_inset_m", "interaction.poles"),
            pull.magnet is not None or varied.magnets is not None,
            "without --magnets",
        ),
        (("interaction.meniscus_height_m",), pull.capillary == "on", "without --capillary on"),
        (
            ("assembly.relatch_clearance",),
            rules.bonds_break or varied.bond_rate_per_s is not None,
            "without --bond-rate or --bond-strength: bonds never break",
        ),
    )
    said = []
    for keys, has_effect, without in needs:
        idle = [option_name(key, keys=given.keys) for key in keys if key in given.overrides]
        if idle and not has_effect:
            verb = "has" if len(idle) == 1 else "have"
            said.append(f"{' and '.join(idle)} {verb} no effect {without}")
    return said


def refuse_found(folder: Path, overrides: Mapping[str, Any], *, also: Sequence[str] = ()) -> None:
    """Refuse options for what a run has found.

    Raises
    ------
    InputError
        Names the options.
    """
    refused = [*(option_name(key) for key in FOUND_BY_A_RUN if key in overrides), *also]
    if refused:
        raise InputError(
            f"{', '.join(refused)}: not with a finished run, whose own values are used; to give "
            f"them, take the run's flow field alone: --flow {folder}"
        )


def _source_from_run(folder: Path, flow_file: Path | None, given: StudyOptions) -> Source:
    """Return the model of the block that a run has found, in its flow field or another one.

    The sections [assembly], [interaction] and [sensitivity] of a study file take the place of the
    run's, and it may say how a flow series is met; the model is the run's.
    """
    from driftwalk.runs import read_found

    found = read_found(folder)
    base, study, inputs = f"the study of {folder}", found.block_study(), found.inputs
    if given.file is not None:
        base, study = str(given.file), _with_sections(study, given.file, folder)
        inputs["study"] = given.file
    chosen = given.over(study, base=base)
    if flow_file is None:
        field = found.flow(study)
    else:
        field, inputs["flow"] = load_flow_for(flow_file, chosen), flow_file
    field, stretched = _in_tank(field, given, chosen)
    warnings = [*found.warnings, *_without_effect(given, chosen), *stretched]
    inputs |= _table_of(chosen)
    drawn = (found.uncertainty, inputs, warnings, found.not_drawn, found.first_force)
    return Source(chosen, field, *drawn)


GLUED: Final = {
    "hidden_face_drag_share": "assembly.hidden_face_drag",
    "stirring_length": "forces.stirring_length_m",
}
"""Parameters of a fit of glued blocks, and the keys of a study that they are."""


def with_glued(given: StudyOptions, folder: Path | None) -> tuple[StudyOptions, dict[str, Floats]]:
    """Return the options with what a fit of glued blocks says, where they do not say it.

    The quantiles of these numbers come second, by their keys.

    Raises
    ------
    InputError
        When the run is not one of glued blocks after a fit of one block.
    """
    if folder is None:
        return given, {}
    from driftwalk.assembly import interaction_quantiles
    from driftwalk.runs import read_earlier_fit
    from driftwalk.schema.answers.facts import fitted_value
    from driftwalk.schema.kinds.fit import PARAMETERS

    found = read_earlier_fit(folder).fit
    try:
        quantiles = interaction_quantiles(found)
    except InputError as error:
        raise InputError(
            f"{folder}: {error} (driftwalk fit DIMER --body-shape xx --earlier-fit FIT, driftwalk "
            "fit PAIR --interaction)"
        ) from None
    values, said = {}, []
    for name, key in GLUED.items():
        if key in quantiles:
            value = values[key] = fitted_value(found, name)
            low, high = found["interval"].sel(parameter=name).values
            unit = " m" if name == "stirring_length" else ""
            said.append(f"{PARAMETERS[name].words} {value:.2g} ({low:.2g} to {high:.2g}){unit}")
    print_note(f"{'; '.join(said)}: from {folder}")
    kept = {key: value for key, value in values.items() if key not in given.overrides}
    drawn = {key: values for key, values in quantiles.items() if key in kept}
    return given.and_also(kept, keys=given.keys), drawn


def with_binding(given: StudyOptions, path: Path | None) -> StudyOptions:
    """Return the options with the rules of typed faces of a file, and as many blocks as they count.

    Raises
    ------
    ConfigurationError
        When the file is wrong, or names another number of blocks than an option.
    """
    if path is None:
        return given
    from driftwalk.model import read_binding

    found = read_binding(path)
    wanted = given.overrides.get("assembly.blocks", found.blocks)
    if "assembly.faces" in given.overrides:
        raise InputError(f"--faces and --binding {path} both say which faces latch: give one")
    if wanted != found.blocks:
        raise InputError(
            f"{path}: the kinds count {found.blocks} blocks, and --blocks says {wanted}; make them "
            "the same"
        )
    rules = found.model_dump(exclude_unset=True)
    return given.and_also(
        {"assembly.blocks": found.blocks, "assembly.binding": rules}, keys=given.keys
    )


def load_flow_for(path: Path, study: Study) -> xr.Dataset:
    """Return the flow field of a file; one that knows no tank is that of the study's."""
    from driftwalk.flow import load_flow

    field = load_flow(path, arena=study.tank.to_arena(), own_flags="keep")
    if field.attrs.get("method") == "file" and "warning" in field.attrs:
        print_note(f"warning: {path}: {to_options(field.attrs['warning'])}")
    return field


def _with_sections(study: Study, path: Path, folder: Path) -> Study:
    """Return the run's study with the sections of a file that say what is simulated."""
    from driftwalk.model import load_study

    given = load_study(path)
    for name in MODEL_KEYS:
        section, _, one = name.partition(".")
        theirs, ours = getattr(given, section), getattr(study, section)
        for key in [one] if one else sorted(theirs.model_fields_set):
            stated = key in theirs.model_fields_set and f"{section}.{key}" not in SEARCHED
            if stated and getattr(theirs, key) != getattr(ours, key):
                raise InputError(
                    f"{path}: [{section}] {key} is {getattr(theirs, key)}, and {folder} was "
                    f"made with {getattr(ours, key)}; leave it out of the file, or take the run's "
                    f"flow field alone: --flow {folder}"
                )
    series = ("repeat", "start")
    flow = {key: getattr(given.flow, key) for key in series if key in given.flow.model_fields_set}
    return study.model_copy(
        update={
            "assembly": given.assembly,
            "interaction": given.interaction,
            "sensitivity": given.sensitivity,
            "flow": study.flow.model_copy(update=flow),
        }
    )


@dataclass(frozen=True)
class ModelSource:
    """The model that simulate, play and study recover take: found by a run, or named.

    Attributes
    ----------
    given : StudyOptions
        The options and the study file.
    named : str or None
        The motion model that is named.
    folder : Path or None
        The run directory.
    found : FoundRun or None
        What the run has found.
    """

    given: StudyOptions
    named: str | None
    folder: Path | None
    found: FoundRun | None

    @property
    def is_block(self) -> bool:
        """Whether the model is the block in stirred water."""
        return self.named is None and (self.found is None or self.found_block)

    @property
    def found_block(self) -> bool:
        """Whether there is a run, and it is about the block."""
        from driftwalk.motion import BlockModel

        return self.found is not None and self.found.model == BlockModel.name

    def study(self) -> Study:
        """Return the study of the run, where it has one, with the options over it."""
        if self.found is not None and self.found_block:
            own = self.found.block_study()
        elif self.found is not None and self.given.file is None and self.found.has_study:
            own = self.found.study()
        else:
            return self.given.study()
        return self.given.over(own, base=f"the study of {self.folder}")

    def flow_for(self, model: MotionModel, study: Study, flow: Path | None) -> xr.Dataset | None:
        """Return the flow for a model: a given one, that of the run if it is used, or None."""
        if flow is not None:
            return load_flow_for(flow, study)
        return self.found.flow(study) if self.found is not None and model.needs_flow else None


def flow_of_block(found: FoundRun, study: Study, flow: Path | None) -> xr.Dataset:
    """Return the flow for the block that a run has found: a given one, or that of the run."""
    return found.flow(found.block_study()) if flow is None else load_flow_for(flow, study)


def open_source(folder: Path | None, given: StudyOptions, model: str | None) -> ModelSource:
    """Return what the user has named as the model: a run, a motion model, or both.

    Raises
    ------
    InputError
        When the run cannot be used, or an option contradicts it.
    """
    from driftwalk.runs import read_found

    if folder is None:
        return ModelSource(given, model, None, None)
    found = read_found(folder)
    source = ModelSource(given, model, folder, found)
    # The values of another model hold in any study; those of the block belong to its own.
    own = source.found_block and given.file is not None
    refuse_found(folder, given.overrides, also=["--study"] if own else [])
    # A comparison of models holds values for the block and for others.
    if model is not None and "model" not in found.found.dims and source.found_block:
        raise InputError(f"{folder} is about the block, and not about {model}: leave out --model")
    return source
