"""A known program's table: its header, and what the general reader takes the columns for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from driftwalk.core.errors import FormatError
from driftwalk.record.bad_row import split_fields
from driftwalk.record.raw import Marks, RawRecording, ReadOptions
from driftwalk.record.tables.rows import recording_of
from driftwalk.record.tables.text_source import TextSource
from driftwalk.record.text_head import first_lines, first_row


@dataclass(frozen=True)
class HeadedFormat:
    """A format with one header line, which is recognised by its first names."""

    name: str
    description: str
    header: tuple[str, ...]
    """Names that the header begins with."""
    columns: Mapping[str, str]
    """From a quantity to its column, as `columns` of `load` has it; those that are absent are left
    out."""
    length_unit: str = ""

    @property
    def marks(self) -> tuple[Marks, ...]:
        """Names that a nearly readable file has."""
        return (Marks("table", tuple(filter(None, self.header))),)

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the header."""
        lines = first_lines(head, 1)
        names = tuple(split_fields(lines[0], ",")) if lines else ()
        return 0.95 if names[: len(self.header)] == self.header else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read every body, in the format's own unit of length."""
        names = first_row(path)
        if tuple(names[: len(self.header)]) != self.header:
            raise FormatError(
                f"the first columns are not {', '.join(self.header)}", path=path, line=1
            )
        own = {
            quantity: column
            for quantity, column in self.columns.items()
            if column.partition(":")[0] in names
        }
        rate = None if "t" in own else options.frame_rate_hz
        stated = replace(options, columns=own, delimiter=",", box="none", frame_rate_hz=rate)
        raw = recording_of(TextSource(path, stated), stated)
        return replace(
            raw, length_unit=self.length_unit, bare_length_is_si=False, body_columns=None
        )
