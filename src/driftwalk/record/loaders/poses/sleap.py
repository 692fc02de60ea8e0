"""SLEAP's analysis files, pixels, no clock: HDF5 over track, xy, node and frame, or CSV.

CSV: ``track,frame_idx,instance.score,NODE.x,NODE.y,NODE.score,...``, one row per instance.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import FormatError
from driftwalk.core.text.json_text import parse_json
from driftwalk.record.cleaning.several_bodies import split_bodies
from driftwalk.record.pose import Confidence, Point, choose_keypoints, recording_of_poses
from driftwalk.record.raw import Marks, RawRecording, ReadOptions, TableLayout
from driftwalk.record.stores.hdf5 import Hdf5Contents, names_in, opened_hdf5, text_of
from driftwalk.record.text import read_table
from driftwalk.record.text_head import first_names, first_row

ORDER: Final = ("track", "xy", "node", "frame")
"""Dimensions as SLEAP writes them; newer files name theirs in an attribute."""
USUAL: Final = Confidence(0.2, "SLEAP's threshold of peaks")


class SleapLoader:
    """Nodes of every track; of several one has to be named."""

    name = "sleap"
    description = "SLEAP analysis HDF5 (tracks, node_names; pixels, no clock)"
    marks = (Marks("HDF5", ("tracks", "node_names", "track_names", "track_occupancy")),)

    def sniff(self, head: bytes, path: Path) -> float:
        """Recognise the names of its arrays."""
        return 0.95 if {"tracks", "node_names"} <= names_in(path, head) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the chosen nodes of every track."""
        with opened_hdf5(path) as contents:
            nodes = contents.texts("node_names")
            tracks = _in_order(contents, "tracks", ORDER)
            if tracks.shape[1:3] != (2, len(nodes)):
                raise FormatError(
                    f"'tracks' has the shape {tracks.shape}, expected track, xy, node, frame with "
                    f"{len(nodes)} nodes"
                )
            names = contents.texts("track_names") if "track_names" in contents.file else []
            scores = _scores(contents, tracks.shape)
        individuals = names if len(names) == len(tracks) else [str(at) for at in range(len(tracks))]

        def read_point(place: tuple[int, int]) -> Point:
            x, y = (np.array(tracks[place[0], axis, place[1]], dtype=np.float64) for axis in (0, 1))
            return x, y, None if scores is None else scores[place].astype(np.float64)

        places = {
            individual: {node: (of, at) for at, node in enumerate(nodes)}
            for of, individual in enumerate(individuals)
        }
        frame = np.arange(tracks.shape[3], dtype=np.float64)
        chosen = choose_keypoints(nodes, options)
        return recording_of_poses(places, read_point, chosen, frame, options, usual=USUAL)


def _in_order(
    contents: Hdf5Contents, name: str, order: tuple[str, ...]
) -> npt.NDArray[np.floating[Any]]:
    """Return an array of numbers with its dimensions in this order."""
    values = contents.array(name)
    if values.dtype.kind not in "fiu" or values.ndim != len(order):
        raise FormatError(f"'{name}' has no numbers over {', '.join(order)}")
    stated = contents.file[name].attrs.get("dims")
    dims = list(order) if stated is None else parse_json(text_of(stated), path=contents.path)
    if sorted(map(str, dims)) != sorted(order):
        raise FormatError(f"'{name}' is over {dims}, expected {', '.join(order)}")
    return values.transpose([dims.index(dimension) for dimension in order])


def _scores(contents: Hdf5Contents, shape: tuple[int, ...]) -> npt.NDArray[Any] | None:
    """Return the scores of the nodes, None where the file has none."""
    if "point_scores" not in contents.file:
        return None
    scores = _in_order(contents, "point_scores", ("track", "node", "frame"))
    if scores.shape != (shape[0], *shape[2:]):
        raise FormatError("'point_scores' has another shape than 'tracks'")
    return scores


class SleapCsvLoader:
    """Nodes of every track; of several one has to be named."""

    name = "sleap-csv"
    description = "SLEAP analysis CSV (track, frame_idx, NODE.x, NODE.y, NODE.score; pixels)"
    marks = (Marks("table", ("track", "frame_idx", "instance.score")),)

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the header."""
        names = first_names(head)
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
            raise FormatError("no columns frame_idx, NODE.x and NODE.y", line=1)
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

        own, clock = {"0": {node: node for node in nodes}}, table.numbers[frame]
        raw = recording_of_poses(own, read_point, chosen, clock, options, usual=USUAL)
        if track is not None:
            (rows,) = raw.bodies
            raw.bodies = split_bodies(rows, table.codes[track], table.labels[track])
            for one in raw.bodies:
                if not one.name and np.unique(one.clock).size < one.clock.size:
                    raise FormatError(
                        "several instances of one frame have no track: let SLEAP track them, and "
                        "export again"
                    )
                one.name = one.name or "0"
        return raw


LOADERS = (SleapLoader(), SleapCsvLoader())
