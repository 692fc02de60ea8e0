"""Plain tables: CSV, TSV, semicolons or blanks, with or without header, columns named or mapped."""

from __future__ import annotations

from pathlib import Path

from driftwalk.record.raw import RawRecording, ReadOptions
from driftwalk.record.tables.rows import recording_of
from driftwalk.record.tables.text_source import TextSource
from driftwalk.record.text_head import first_lines


class PlainLoader:
    """A table with one row per sample; bodies side by side, stacked, or one alone."""

    name = "csv"
    description = (
        "plain CSV, TSV or blank-separated table, columns recognised or named by `columns`"
    )

    def sniff(self, head: bytes, _path: Path) -> float:
        """Accept any text, so weakly that every other format wins."""
        lines = first_lines(head, 2)
        return 0.1 if lines and not lines[0].lstrip().startswith(("[", "{", "$", "<")) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the table as its header and `columns` describe it."""
        return recording_of(TextSource(path, options), options)


LOADER = PlainLoader()
