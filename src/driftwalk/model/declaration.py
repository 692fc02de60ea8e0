"""The declaration of one key of a study: its meaning, number and words, for options and help."""

from __future__ import annotations

import re
from dataclasses import dataclass

from driftwalk.core.errors import ConfigurationError
from driftwalk.model.section import (
    OrNumber,
    Placeholder,
    Quantity,
    Section,
    description_of,
    is_list,
    item_quantity_of,
    quantity_of,
    words_of,
)
from driftwalk.model.study import Study

# A sentence may begin with a word in quotes; "Eq. 4" is no end of one.
_END_OF_SENTENCE = re.compile(r'(?<=\.) (?=[A-Z"])')


@dataclass(frozen=True)
class Declaration:
    """Unit, bounds, words and meaning of one key of a study.

    Attributes
    ----------
    meaning : str
        In one sentence: the title of the field, or the first sentence of its description.
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
    section = _sections().get(name)
    if section is None or field_name not in section.model_fields:
        raise ConfigurationError(f"a study has no key '{key}'")
    field = section.model_fields[field_name]
    number = next((one.key for one in field.metadata if isinstance(one, OrNumber)), field_name)
    placeholders = [one.text for one in field.metadata if isinstance(one, Placeholder)]
    return Declaration(
        meaning=field.title or _END_OF_SENTENCE.split(description_of(section, field_name))[0],
        quantity=quantity_of(section, number) or item_quantity_of(section, field_name),
        words=words_of(section, field_name),
        is_list=is_list(section, field_name),
        placeholder="".join(placeholders),
    )


def _sections() -> dict[str, type[Section]]:
    """Return the sections of a study by their names, without making one."""
    kinds = {name: field.annotation for name, field in Study.model_fields.items()}
    return {
        name: kind
        for name, kind in kinds.items()
        if isinstance(kind, type) and issubclass(kind, Section)
    }
