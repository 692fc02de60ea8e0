"""The study: every parameter of a piece of work, in one frozen object and one TOML file.

A new study file comes from a template with comments; the reference page shows the same table.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Self

from pydantic import Field, model_validator

from driftwalk.core.errors import ConfigurationError, FormatError, did_you_mean
from driftwalk.core.text_files import parse_toml, read_toml
from driftwalk.model.assembly import Assembly
from driftwalk.model.block import Block, Flow, Forces
from driftwalk.model.calibration import Calibration
from driftwalk.model.fit import Fit
from driftwalk.model.interaction import Interaction
from driftwalk.model.recording import Observation, Recording, Steps
from driftwalk.model.recover import Recover
from driftwalk.model.section import (
    OrNumber,
    Placeholder,
    Quantity,
    Section,
    description_of,
    is_list,
    meaning_of,
    quantity_of,
    quoted,
    toml_lines,
    toml_text,
    words_of,
)
from driftwalk.model.sensitivity import Sensitivity
from driftwalk.model.simulation import Pose, Simulation, resolve_time_step
from driftwalk.model.tank import Tank, Water

if TYPE_CHECKING:
    from driftwalk.model.rigid_bodies import RigidBody


class Study(Section):
    """All parameters of a simulation or calibration, everything except the recording itself.

    A study is frozen, refuses unknown keys and contradictions, and survives a round trip through
    its TOML file. Sections may be given as objects or as dictionaries.

    Raises
    ------
    ConfigurationError
        When a key is unknown, a value out of range, or two values contradict each other.

    Examples
    --------
    >>> Study(forces={"force_interval_s": "16ms"}).time_step_s
    0.008
    """

    block: Block = Field(default_factory=Block)
    """The floating block."""
    tank: Tank = Field(default_factory=Tank)
    """The tank and its wall."""
    water: Water = Field(default_factory=Water)
    """The liquid."""
    forces: Forces = Field(default_factory=Forces)
    """Drag and stochastic force."""
    simulation: Simulation = Field(default_factory=Simulation)
    """Settings of a simulation."""
    observation: Observation = Field(default_factory=Observation)
    """Effects of the camera on the poses."""
    recording: Recording = Field(default_factory=Recording)
    """Reading of the recording."""
    flow: Flow = Field(default_factory=Flow)
    """Extraction of the flow field from the recording."""
    steps: Steps = Field(default_factory=Steps)
    """Formation of steps."""
    calibration: Calibration = Field(default_factory=Calibration)
    """Search of a calibration."""
    fit: Fit = Field(default_factory=Fit)
    """Joint fit of flow, drag, force and tracking noise."""
    recover: Recover = Field(default_factory=Recover)
    """Recordings of known truth that a recovery study simulates and fits."""
    assembly: Assembly = Field(default_factory=Assembly)
    """Rules of self-assembly, and the number of runs."""
    interaction: Interaction = Field(default_factory=Interaction)
    """Forces between blocks at a distance."""
    sensitivity: Sensitivity = Field(default_factory=Sensitivity)
    """Axes and size of a sensitivity analysis."""

    @model_validator(mode="after")
    def _time_step_divides(self) -> Self:
        _ = self.time_step_s
        return self

    @model_validator(mode="after")
    def _block_fits(self) -> Self:
        side, tank, square = self.block.side_m, self.tank, self.block.shape == "square"
        # In a round tank the corners decide; between straight walls a block may lie along them.
        widest = side * math.sqrt(2.0) if square else 2.0 * self.block.body().reach_m
        needed = side if square and tank.shape != "circle" else widest
        if needed >= tank.narrowest_m:
            raise ConfigurationError(
                f"the block does not fit into the tank: [block] side_m = {side:g} (diagonal "
                f"{widest:.3g} m), [tank] is a {tank.describe()}"
            )
        return self

    @model_validator(mode="after")
    def _start_inside(self) -> Self:
        start = self.simulation.start
        if isinstance(start, Pose) and not all(
            self.tank.contains(x, y) for x, y in block_corners(start, self.block)
        ):
            raise ConfigurationError(
                f"[simulation] start at ({start.x_m:g}, {start.y_m:g}) m puts a corner of the "
                f"block (side_m = {self.block.side_m:g}) outside [tank], a {self.tank.describe()}"
            )
        return self

    @property
    def time_step_s(self) -> float:
        """Time step of the integrator [s], "auto" resolved; it divides the force interval."""
        return resolve_time_step(
            self.simulation.time_step_s, force_interval_s=self.forces.force_interval_s
        )

    @property
    def wetted_depth_m(self) -> float:
        """Wetted depth d of a side face [m]."""
        return self.block.wetted_depth_m(self.water.density_kg_m3)

    def body(self) -> RigidBody:
        """Return the outline of the body, with this study's drag on hidden faces."""
        return self.block.body(self.assembly.hidden_share)

    @property
    def force_lever_m(self) -> float:
        """Lever with which the stochastic force turns the body [m]."""
        stated = self.forces.force_lever_m
        if stated is not None or self.block.shape == "square":
            return stated or 0.0
        return self.body().force_lever_m(self.forces.stirring_length_m)

    @property
    def displaced_mass_kg(self) -> float:
        """Mass m_w of the displaced water [kg]: the block's own, since it floats.

        The wetted depth does not count. It is that of the drag, which depends on the product of
        depth and drag coefficient alone, and may be stated as the paper's.
        """
        return self.block.mass_kg

    def load_options(self) -> dict[str, Any]:
        """Return the keyword arguments with which `driftwalk.record.load` reads the recording.

        A polygonal tank is in the file's own frame: it takes no `tank`, and the caller writes
        `Tank.to_arena_json` into the trajectory's attributes.
        """
        options = self.recording.load_options()
        if self.recording.arena == "fit":
            return {**options, "tank": "fit", "block": self.block.side_m}
        if self.recording.arena == "file" or self.tank.shape == "polygon":
            return options
        center = self.recording.arena_center_m
        at = "" if center is None else f"@{center[0]!r},{center[1]!r}"
        width, height = self.tank.extent_m
        size = f"circle:{width!r}" if self.tank.shape == "circle" else f"rect:{width!r}x{height!r}"
        return {**options, "tank": f"{size}{at}"}

    def to_dict(self) -> dict[str, Any]:
        """Return the study as plain dictionaries, without the keys that are not set."""
        return self.model_dump(mode="python", exclude_none=True)

    def to_toml(self) -> str:
        """Return the study as the text of a study file; `load_study` reads the same study back."""
        parts = ["\n".join([f"[{name}]", *toml_lines(section)]) for name, section in self]
        return "\n\n".join(parts) + "\n"


def block_corners(pose: Pose, block: Block) -> list[tuple[float, float]]:
    """Return the corners of a body [m] at a pose; of a disc, points of its rim."""
    if block.shape == "square":
        reach = block.side_m / math.sqrt(2.0)
        angles = (pose.theta_rad + math.pi * (0.25 + 0.5 * quarter) for quarter in range(4))
        return [
            (pose.x_m + reach * math.cos(angle), pose.y_m + reach * math.sin(angle))
            for angle in angles
        ]
    body, turn = block.body(), complex(math.cos(pose.theta_rad), math.sin(pose.theta_rad))
    outline = body.panels[:, :2] if body.disc_radius_m else body.corners
    turned = [complex(x, y) * turn + complex(pose.x_m, pose.y_m) for x, y in outline]
    return [(corner.real, corner.imag) for corner in turned]


def load_study(path: str | Path) -> Study:
    """Read a study file.

    Parameters
    ----------
    path : path-like
        A TOML file. Keys that it lacks have their defaults; a number may be text with a unit
        (``force_std_N = "0.55mN"``).

    Returns
    -------
    Study
        Frozen.

    Raises
    ------
    ConfigurationError
        When the file is not TOML, names an unknown key, or holds a wrong value; the message names
        file, section and key.
    OSError
        When the file cannot be read.

    Examples
    --------
    >>> load_study("study.toml").tank.diameter_m  # doctest: +SKIP
    0.3
    """
    return _study(lambda: read_toml(path), source=str(path))


def parse_study(text: str, *, source: str = "study") -> Study:
    """Return the study in the text of a study file.

    Parameters
    ----------
    text : str
        TOML.
    source : str
        Name of the text in an error message.

    Raises
    ------
    ConfigurationError
        See `load_study`.

    Examples
    --------
    >>> parse_study('forces.force_std_N = "0.6mN"').forces.force_std_N
    0.0006
    """
    return _study(lambda: parse_toml(text), source=source)


def _study(read: Callable[[], dict[str, Any]], *, source: str) -> Study:
    try:
        return Study(**read())
    except FormatError as error:
        raise ConfigurationError(f"{source}: {error.reason}") from error
    except ConfigurationError as error:
        raise ConfigurationError(f"{source}: {error}") from error


def apply_overrides(study: Study, overrides: Mapping[str, Any]) -> Study:
    """Return a study in which some parameters have other values.

    Parameters
    ----------
    study : Study
        The study to start from; it stays as it is.
    overrides : mapping
        From ``"section.key"`` to the value; None returns the key to its default. Keys that replace
        each other do: ``"block.depth_m"`` drops ``depth``, ``"tank.diameter_m"`` makes a circle.

    Raises
    ------
    ConfigurationError
        When there is no such parameter, or the result contradicts itself.

    Examples
    --------
    >>> apply_overrides(Study(), {"tank.diameter_m": "50cm"}).tank.diameter_m
    0.5
    """
    # What the user has not said stays unsaid: a default gives way to what a recording says.
    values = study.model_dump(mode="python", exclude_none=True, exclude_unset=True)
    changes: dict[str, dict[str, Any]] = {}
    for name, value in overrides.items():
        section, dot, key = name.partition(".")
        if section not in Study.model_fields or not dot:
            raise ConfigurationError(
                f"no parameter '{name}'; expected 'section.key' such as 'tank.diameter_m'"
                f"{did_you_mean(section, Study.model_fields)}"
            )
        changes.setdefault(section, {})[key] = value
    for section, changed in changes.items():
        kind = type(getattr(study, section))
        changed = kind.expanded(changed)
        kept = values.setdefault(section, {})
        for key in kind.replaced_by(set(changed)) | set(changed):
            kept.pop(key, None)
        kept.update({key: value for key, value in changed.items() if value is not None})
    return Study(**values)


@dataclass(frozen=True)
class Declaration:
    """Unit, bounds, words and meaning of one key of a study.

    Attributes
    ----------
    meaning : str
        In one sentence.
    quantity : Quantity or None
        The number that it takes, or that an item of its list is; None for a text.
    words : tuple of str
        The words that it takes, alone or instead of a number.
    is_list : bool
        Whether it takes a list.
    placeholder : str
        Shown in the help in place of a text, empty where nothing is declared.
    """

    meaning: str
    quantity: Quantity | None
    words: tuple[str, ...]
    is_list: bool
    placeholder: str


def declared(key: str) -> Declaration:
    """Return the declaration of a key.

    Parameters
    ----------
    key : str
        Such as ``"tank.diameter_m"``. A word that may be given as a number under another key
        (``"block.depth"``) has the quantity of that key.

    Raises
    ------
    ConfigurationError
        When a study has no such key.

    Examples
    --------
    >>> declared("simulation.time_step_s").words, declared("simulation.time_step_s").quantity.unit
    (('auto',), 's')
    >>> declared("block.depth").words, declared("block.depth").quantity.unit
    (('immersed', 'archimedes'), 'm')
    """
    name, _, field_name = key.partition(".")
    of_study = Study.model_fields.get(name)
    section: Any = None if of_study is None else of_study.annotation
    if section is None or field_name not in section.model_fields:
        raise ConfigurationError(f"a study has no key '{key}'")
    field = section.model_fields[field_name]
    number = next((one.key for one in field.metadata if isinstance(one, OrNumber)), field_name)
    placeholders = [one.text for one in field.metadata if isinstance(one, Placeholder)]
    return Declaration(
        meaning=meaning_of(section, field_name),
        quantity=quantity_of(section, number),
        words=words_of(section, field_name),
        is_list=is_list(section, field_name),
        placeholder="".join(placeholders),
    )


_HEAD = """\
# Study file of driftwalk. Every parameter is here with its default; a line that starts with
# "# key =" is a parameter that is not set. SI units; a number may also be text with a unit, such
# as "0.55mN", "16ms" or "30cm". A key that you leave out has its default; an unknown key is an
# error.
"""


_SHORT_HEAD = """\
# Study file of driftwalk: the block and the tank. Each "# key =" line shows the default, which is
# the paper's. Where yours differs, take the "# " away, before the name in [ ] too, and write your
# value: in SI units, or text with a unit, such as "3cm" or "11.6g". A key that you leave out has
# its default.
"""
FIRST: Final = {"block": ("side_m", "mass_kg"), "tank": ("diameter_m", "wall_friction")}
"""Parameters that no two tanks share, and that every result depends on."""


def study_template(study: Study | None = None) -> str:
    """Return a study file that lists every parameter with its unit, range and meaning.

    Parameters
    ----------
    study : Study, optional
        The values to write; the defaults when left out.

    Examples
    --------
    >>> study_template().splitlines()[5]
    '# The floating block.'
    """
    chosen = study if study is not None else Study()
    parts = [_HEAD]
    for name in Study.model_fields:
        lines = [*_comment(description_of(Study, name)), f"[{name}]"]
        section = getattr(chosen, name)
        for key in type(section).model_fields:
            lines += _commented_parameter(section, key)
        parts.append("\n".join(lines) + "\n")
    return "\n".join(parts)


def short_study_template() -> str:
    """Return a study file with what differs from tank to tank; it states nothing yet.

    All of its lines are comments, so that a table can be written below them.

    Examples
    --------
    >>> print(short_study_template().splitlines()[5])
    # [block]
    """
    parts = [_SHORT_HEAD]
    for name, keys in FIRST.items():
        section = getattr(Study(), name)
        lines = [f"# [{name}]"]
        for key in keys:
            meaning, *_ = description_of(type(section), key).partition(". ")
            lines += [*_comment(meaning.rstrip(".") + "."), f"# {key} = {_value(section, key)}"]
        parts.append("\n".join(lines) + "\n")
    return "\n".join(parts)


def _value(section: Section, key: str) -> str:
    """Return the value of a parameter, or one that could stand there."""
    value = getattr(section, key)
    return _example(type(section), key) if value is None else toml_text(value)


def parameter_table(name: str) -> str:
    """Return the parameters of one section as a Markdown table.

    Parameters
    ----------
    name : str
        Name of the section.

    Examples
    --------
    >>> parameter_table("steps").splitlines()[0]
    '| key | default | values | meaning |'
    """
    section = getattr(Study(), name)
    rows = ["| key | default | values | meaning |", "|---|---|---|---|"]
    for key in type(section).model_fields:
        value = getattr(section, key)
        default = f"`{toml_text(value)}`" if value is not None else "not set"
        accepted = _accepted(type(section), key).replace("|", "\\|")
        meaning = description_of(type(section), key)
        rows.append(f"| `{key}` | {default} | {accepted} | {meaning} |")
    return "\n".join(rows)


def _commented_parameter(section: Section, key: str) -> Iterator[str]:
    kind = type(section)
    value = getattr(section, key)
    accepted = _accepted(kind, key)
    description = description_of(kind, key)
    yield ""
    yield from _comment(f"{description} [{accepted}]" if accepted else description)
    yield f"{key} = {toml_text(value)}" if value is not None else f"# {key} = {_example(kind, key)}"


def _example(kind: type[Section], key: str) -> str:
    """Return a value to stand in the place of one that is not set."""
    example = (kind.model_fields[key].examples or [""])[0]
    return example if isinstance(example, str) and example[:1] in "{[" else toml_text(example)


def _accepted(kind: type[Section], key: str) -> str:
    """Return unit, range and words of a parameter, in short."""
    if kind.model_fields[key].annotation is bool:
        return "true or false"
    quantity, words, parts = quantity_of(kind, key), words_of(kind, key), []
    if quantity is not None:
        unit = quantity.unit if quantity.unit != "1" else "number"
        name = "whole number" if quantity.whole else unit
        parts.append(", ".join(filter(None, (name, quantity.range_text()))))
    if words:
        parts.append(quoted(words))
    text = ", or ".join(parts)
    return f"list of {text}" if text and is_list(kind, key) else text


def _comment(text: str) -> list[str]:
    return textwrap.wrap(
        text, 96, initial_indent="# ", subsequent_indent="# ", break_long_words=False
    )
