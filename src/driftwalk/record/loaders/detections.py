"""Boxes of detectors: COCO JSON, and a folder of YOLO's text files, one for each frame."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from driftwalk.core.errors import FormatError, InputError
from driftwalk.core.text.json_text import parse_json
from driftwalk.record.bad_row import is_number
from driftwalk.record.loaders.json_formats import bounded_text, column_of
from driftwalk.record.raw import RawRecording, ReadOptions
from driftwalk.record.tables.in_memory import MemorySource
from driftwalk.record.tables.rows import recording_of
from driftwalk.record.text import header_rows

_NAMES: Final = ("frame", "class", "x", "y", "w", "h", "confidence", "track_id")
_IDENTITY: Final = ("track_id", "instance_id", "object_id")
_NUMBER: Final = re.compile(r"\d+$")
_MOST_BOXES: Final = 10_000
"""Boxes of one frame at most; chosen by hand."""


class CocoLoader:
    """The number at the end of an image's name is its frame, else its id."""

    name = "coco"
    description = "COCO JSON, annotations or results (boxes; pixels, no clock)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the keys of images, or of results."""
        start = head[:64].translate(None, b" \t\r\n")
        whole = start.startswith(b"{") and b'"images"' in head and b'"file_name"' in head
        return 0.95 if whole or (start.startswith(b"[{") and b'"bbox"' in head) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read every box."""
        found = parse_json(bounded_text(path), path=path)
        whole = isinstance(found, dict)
        try:
            images = found["images"] if whole else []
            frames = _frames({one["id"]: Path(one["file_name"]).stem for one in images})
            rows = [
                [
                    frames.get(one["image_id"], one["image_id"]),
                    one.get("category_id"),
                    *map(float, one["bbox"]),
                    one.get("score"),
                    next((one[name] for name in _IDENTITY if name in one), None),
                ]
                for one in (found["annotations"] if whole else found)
            ]
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise FormatError(f"is no COCO JSON of boxes: {error!r}") from error
        return _recording(rows, "the boxes", replace(options, box="xywh"))


class YoloFolderLoader:
    """Rows of class, centre and size as shares of the image; confidence and identity may follow."""

    name = "yolo"
    description = "folder of YOLO text files, one a frame (`box` states the size of the image)"

    def sniff(self, _head: bytes, path: Path) -> float:
        """Recognise the shares in one of the first files."""
        try:
            files = _files(path)[:100] if path.is_dir() else []
            return 0.5 if any(_shares("".join(header_rows(file, 1))) for file in files) else 0.0
        except FormatError:
            return 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the files in the order of their numbers."""
        if options.box is None:
            raise InputError(
                "the boxes are shares of the image, and the files do not hold its size: state it "
                'in pixels, as in `box="cxcywh@1920x1080"`'
            )
        files = _files(path)
        frames = _frames({file: file.stem for file in files})
        if not frames:
            raise FormatError("the names of its files do not end in numbers of frames")
        rows = []
        for file in files:
            for number, line in enumerate(header_rows(file, _MOST_BOXES), start=1):
                row = _shares(line)
                if line.strip() and not row:
                    what = "expected class, centre x and y, width, height as shares of the image"
                    raise FormatError(what, path=file, line=number)
                if row:
                    rows.append([frames[file], *row])
        sixth = [row[6] for row in rows if row[6] is not None]
        if all(row[7] is None for row in rows) and any(one > 1.0 for one in sixth):
            rows = [[*row[:6], None, row[6]] for row in rows]  # tracked, without confidences
        return _recording(rows, "the folder", options)


def _files(folder: Path) -> list[Path]:
    """Return the files of the frames in a folder, without that of the names of classes."""
    return sorted(one for one in folder.glob("*.txt") if one.name != "classes.txt")


def _shares(line: str) -> list[float | None]:
    """Return class, shares, confidence and identity of a row; nothing of any other text."""
    fields = line.split()
    if not 5 <= len(fields) <= 7 or not all(map(is_number, fields)):
        return []
    row = [float(field) for field in fields]
    return [*row, *[None] * (7 - len(row))] if all(0.0 <= one <= 1.0 for one in row[1:5]) else []


def _frames(names: dict[Any, str]) -> dict[Any, int]:
    """Return the numbers at the ends of names, none where they are not all different."""
    found = {key: int(end[0]) for key, name in names.items() if (end := _NUMBER.search(name))}
    return found if len(set(found.values())) == len(names) else {}


def _recording(rows: list[list[Any]], what: str, options: ReadOptions) -> RawRecording:
    """Return the recording of rows of `_NAMES`, in the order of their frames."""
    if any(len(row) != len(_NAMES) for row in rows) or not rows:
        raise FormatError("has no boxes of four numbers")
    rows.sort(key=lambda row: float(row[0]))
    columns = dict(zip(_NAMES, zip(*rows, strict=True), strict=True))
    known = {name: column_of([*one]) for name, one in columns.items() if one.count(None) < len(one)}
    raw = recording_of(MemorySource(what, [*known], [*known.values()]), options)
    return replace(raw, length_unit="px")


LOADERS = (CocoLoader(), YoloFolderLoader())
