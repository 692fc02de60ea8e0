"""The options that set keys of a study, and the study that they make.

A command says once which keys its options set, by their names in `driftwalk.core.study_keys`; unit,
words, bounds and meaning of an option are those that the study declares of the key::

    @with_study_options(FIT_KEYS, "side", "mass")
    def fit(given: StudyOptions, json: Json = False) -> None:
        chosen = given.study()

An option that is not given leaves the study file's value as it is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

import typer

from driftwalk.cli.options.flatten_options import Command, Part, spread
from driftwalk.cli.options.shared_types import PANEL, StudyFile, quantity_parser
from driftwalk.cli.terminal.argument_names import option_of, to_options
from driftwalk.core.errors import ConfigurationError
from driftwalk.core.study_keys import CALIBRATION_KEYS, STUDY_KEYS, study_overrides
from driftwalk.model import Declaration, declared

if TYPE_CHECKING:
    from driftwalk.model import Study

PANELS: Final = {"flow": "Flow field (over the study file)"}
"""Panels of the help for sections of a study; the other keys stand in `PANEL`."""
TANK: Final = "tank.diameter_m"
WITH_SECOND: Final = {"bond_rate": "1/s[,N]"}
"""Options of two numbers, the second of which may be left out, and their placeholders."""


@dataclass(frozen=True)
class StudyOptions:
    """The options of a command that concern its study: the file, and values over it.

    Attributes
    ----------
    file : Path or None
        The study file.
    overrides : dict
        From ``"section.key"`` to the value, for the options that are given.
    keys : mapping
        From names of options to keys: an error names the options.
    """

    file: Path | None
    overrides: dict[str, Any]
    keys: Mapping[str, str]

    @property
    def states_tank(self) -> bool:
        """Whether a study file or an option says the tank."""
        return self.file is not None or TANK in self.overrides

    def words(self, *names: str) -> list[str]:
        """Return ``--study`` and those of the named options that are given, as a user types them.

        Examples
        --------
        >>> StudyOptions(None, {"tank.diameter_m": 0.3}, STUDY_KEYS).words("tank_diameter", "side")
        ['--tank', '0.3']
        """
        words = [] if self.file is None else ["--study", str(self.file)]
        for key in (self.keys[name] for name in names):
            if (value := self.overrides.get(key)) is not None:
                text = f"{value:.12g}" if isinstance(value, float) else str(value)
                words += [option_name(key, keys=self.keys), text]
        return words

    def study(self) -> Study:
        """Return the study of the file, or the default one, with the options over it.

        Raises
        ------
        ConfigurationError
            When the file is wrong, or an option contradicts it; the message names both.

        Examples
        --------
        >>> StudyOptions(None, {"forces.force_std_N": 1e-3}, STUDY_KEYS).study().forces.force_std_N
        0.001
        """
        from driftwalk.model import Study, load_study

        study = load_study(self.file) if self.file is not None else Study()
        return self.over(study, base=str(self.file or "the default study"))

    def over(self, study: Study, *, base: str) -> Study:
        """Return a study with the options over it.

        Parameters
        ----------
        study : Study
            The study.
        base : str
            Where it is from, for an error.

        Raises
        ------
        ConfigurationError
            When an option contradicts the study; the message names both.
        """
        from driftwalk.model import apply_overrides

        try:
            return apply_overrides(study, self.overrides)
        except ConfigurationError as error:
            given = [option_name(key, keys=self.keys) for key in self.overrides]
            raise ConfigurationError(f"{', '.join(given)} over {base}: {error}") from error

    def refuse(self, keys: Iterable[str], why: str) -> None:
        """Refuse options that set one of these keys of the study.

        Raises
        ------
        ConfigurationError
            Names the options.
        """
        names = [option_name(key, keys=self.keys) for key in keys if key in self.overrides]
        if names:
            raise ConfigurationError(f"{', '.join(names)}: {why}")

    def and_also(self, overrides: Mapping[str, Any], *, keys: Mapping[str, str]) -> StudyOptions:
        """Return these options and more of them, with the names of the further ones."""
        both = {**self.overrides, **overrides}
        return replace(self, overrides=both, keys={**self.keys, **keys})


def with_study_options(
    keys: Mapping[str, str], *names: str, file: Literal["--study", "none"] = "--study"
) -> Callable[[Command], Command]:
    """Spread a command's parameter of type `StudyOptions` into ``--study`` and one option per name.

    Parameters
    ----------
    keys : mapping
        A table of `driftwalk.core.study_keys`.
    *names : str
        The names in it that the command takes.
    file : {"--study", "none"}
        Whether the command takes a study file by that option.
    """
    parts = {"study": Part(StudyFile, None)} if file == "--study" else {}
    parts |= {name: _part(name, keys) for name in names}

    def make(values: dict[str, Any]) -> StudyOptions:
        path = values.pop("study", None)
        given = {name: _items(value) for name, value in values.items()}
        return StudyOptions(path, study_overrides(keys=keys, **given), keys)

    return partial(spread, kind=StudyOptions, parts=parts, make=make)


def study_option(name: str, keys: Mapping[str, str] = STUDY_KEYS) -> Any:
    """Return the declaration of the option that sets a key of the study.

    Parameters
    ----------
    name : str
        A name in `keys`.
    keys : mapping
        A table of `driftwalk.core.study_keys`.
    """
    key = declared(keys[name])
    quantity = None if key.is_list else key.quantity
    is_whole = quantity is not None and quantity.whole
    plain = quantity is None or is_whole or name in WITH_SECOND
    return typer.Option(
        option_of(name),
        metavar=_metavar(key) if name not in WITH_SECOND else WITH_SECOND[name],
        help=to_options(key.meaning),
        # The largest value is the study's to check: it says nothing to a reader of the help.
        min=quantity.ge if quantity is not None and is_whole else None,
        parser=None if quantity is None or plain else quantity_parser(quantity.unit, *key.words),
        rich_help_panel=PANELS.get(keys[name].partition(".")[0], PANEL),
    )


def option_name(key: str, *, keys: Mapping[str, str] = STUDY_KEYS) -> str:
    """Return the option that sets a key of the study, the key itself where there is none."""
    key = "block.depth" if key == "block.depth_m" else key
    known = (*keys.items(), *STUDY_KEYS.items(), *CALIBRATION_KEYS.items())
    names = [name for name, one in known if one == key]
    return option_of(names[0]) if names else key


def _part(name: str, keys: Mapping[str, str]) -> Part:
    key = declared(keys[name])
    kind: Any = str
    if key.is_list:
        kind = list[str]
    elif key.quantity is not None and name not in WITH_SECOND:
        kind = int if key.quantity.whole else Any
    return Part(Annotated[kind | None, study_option(name, keys)], None)


def _metavar(key: Declaration) -> str | None:
    """Return the placeholder of the value in the help."""
    if key.placeholder:
        return key.placeholder
    if key.quantity is None:
        return "|".join(key.words) or None
    unit = key.quantity.unit if key.quantity.unit != "1" else "NUMBER"
    if key.is_list:
        return f"{unit},{unit},..."
    return "N" if key.quantity.whole else "|".join((*key.words, unit))


def _items(value: Any) -> Any:
    """Return the items of a list, which commas part, or the value of any other option."""
    if not isinstance(value, list):
        return value
    return [item.strip() for text in value for item in text.split(",")]


Side = Annotated[float | None, study_option("side")]
