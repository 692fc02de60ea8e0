"""SLEAP's analysis tables: ``track,frame_idx,instance.score,NODE.x,NODE.y,NODE.score,...``.

One row per instance; pixels, no clock.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import FormatError
from driftwalk.record.bad_row import split_fields
from driftwalk.record.cleaning.stacked import split_bodies
from driftwalk.record.loaders.poses.sleap import USUAL
from driftwalk.record.pose.keypoints import Point, Poses, bodies_of, choose_keypoints
from driftwalk.record.raw import Array, Marks, RawRecording, ReadOptions, TableLayout
from driftwalk.record.text import read_table
from driftwalk.record.text_head import first_lines, first_row


class SleapCsvLoader:
    """Nodes of every track; of several one has to be named."""

    name = "sleap-csv"
    description = "SLEAP analysis CSV (track, frame_idx, NODE.x, NODE.y, NODE.score; pixels)"
    marks = (Marks("table", ("track", "frame_idx", "instance.score")),)

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the header."""
        lines = first_lines(head, 1)
        names = split_fields(lines[0], ",") if lines else []
        dotted = any(name.endswith(".x") and f"{name[:-2]}.y" in names for name in names)
        return 0.95 if "frame_idx" in names and dotted else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the chosen nodes of every track."""
        names = first_row(path)
        places = {name: at for at, name in enumerate(names)}
        nodes = {
            name[:-2]: [places.get(f"{name[:-2]}.{part}", -1) for part in ("x", "y", "score")]
            for name in names
            if name.endswith(".x") and f"{name[:-2]}.y" in places
        }
        if "frame_idx" not in places or not nodes:
            raise FormatError("no columns frame_idx, NODE.x and NODE.y", path=path, line=1)
        chosen = choose_keypoints(list(nodes), options)
        used = {at for node in chosen.names() for at in nodes[node] if at >= 0}
        frame, track = places["frame_idx"], places.get("track")
        texts = () if track is None else (track,)
        table = read_table(
            path, TableLayout(",", names, 1, tuple(sorted({frame, *used} - set(texts))), texts)
        )

        def read_point(node: str) -> Point:
            x, y, score = nodes[node]
            return table.numbers[x], table.numbers[y], table.numbers.get(score)

        poses = Poses({"0": {node: node for node in nodes}}, read_point)
        rows, notes = bodies_of(poses, chosen, table.numbers[frame], options, usual=USUAL)
        bodies = rows
        if track is not None:
            _require_tracks(table.labels[track], table.codes[track], rows[0].clock, path)
            bodies = split_bodies(
                table.codes[track],
                [label or "0" for label in table.labels[track]],
                clock=rows[0].clock,
                x=rows[0].x,
                y=rows[0].y,
                theta=rows[0].theta,
            )
        return RawRecording(
            bodies, length_unit="px", has_keypoints=True, rows=table.rows, notes=notes
        )


def _require_tracks(
    labels: list[str], codes: npt.NDArray[np.int32], frame: Array, path: Path
) -> None:
    """Refuse several instances of a frame that no track tells apart."""
    if "" not in labels:
        return
    frames = frame[codes == labels.index("")]
    if np.unique(frames).size < frames.size:
        raise FormatError(
            "several instances of one frame have no track: let SLEAP track them, and export again",
            path=path,
        )


LOADER = SleapCsvLoader()
