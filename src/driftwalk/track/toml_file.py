"""Reading and writing the small TOML files of the tracker: sections, with units in the keys."""

from __future__ import annotations

from pathlib import Path
from typing import TypeVar

from driftwalk.core.errors import ConfigurationError, FormatError
from driftwalk.core.files.atomic import atomic_path
from driftwalk.core.text_files import read_toml
from driftwalk.model.section import Section, description_of, toml_text

Kind = TypeVar("Kind", bound=Section)


def load_sections(path: str | Path, kind: type[Kind], *, what: str) -> Kind:
    """Read a TOML file as one section with its sections.

    Raises
    ------
    FormatError
        When the file is not there, is no TOML, or a key is wrong; the message names the file.
    """
    file = Path(path)
    try:
        return kind(**read_toml(file))
    except FileNotFoundError:
        raise FormatError(f"no such {what} file", path=file) from None
    except IsADirectoryError:
        raise FormatError(f"is a folder, not a {what} file", path=file) from None
    except FormatError as error:
        raise FormatError(f"is not a {what} file: {error.reason}", path=file) from None
    except ConfigurationError as error:
        raise FormatError(str(error), path=file) from None


def save_sections(path: str | Path, section: Section, *, head: str) -> Path:
    """Write a section with its sections as TOML, the meaning of each key above it."""
    with atomic_path(path) as partial:
        partial.write_text(to_toml(section, head=head), encoding="utf-8")
    return Path(path)


def to_toml(section: Section, *, head: str) -> str:
    """Return a section with its sections as commented TOML."""
    plain, nested = [f"# {line}" for line in head.splitlines()], []
    for key in type(section).model_fields:
        value, description = getattr(section, key), description_of(type(section), key)
        if value is None:
            continue
        if isinstance(value, Section):
            # The section's name stands under the comment that says what it is.
            comment, _, keys = to_toml(value, head=description).partition("\n")
            nested.append(f"{comment}\n[{key}]\n{keys.strip()}")
        else:
            plain += ["", f"# {description}", f"{key} = {toml_text(value)}"]
    return "\n\n".join(["\n".join(plain).strip(), *nested]) + "\n"
