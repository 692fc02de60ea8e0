"""SLEAP's analysis files in HDF5: ``tracks`` over track, xy, node and frame; pixels, no clock."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import FormatError
from driftwalk.core.text.json_text import parse_json
from driftwalk.record.pose.keypoints import Confidence, Point, Poses, bodies_of, choose_keypoints
from driftwalk.record.raw import Marks, RawRecording, ReadOptions
from driftwalk.record.stores.hdf5 import Hdf5Contents, names_in, opened_hdf5, text_of

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
                    f"{len(nodes)} nodes",
                    path=path,
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
        bodies, notes = bodies_of(Poses(places, read_point), chosen, frame, options, usual=USUAL)
        return RawRecording(
            bodies, length_unit="px", has_keypoints=True, rows=frame.size, notes=notes
        )


def _in_order(
    contents: Hdf5Contents, name: str, order: tuple[str, ...]
) -> npt.NDArray[np.floating[Any]]:
    """Return an array of numbers with its dimensions in this order."""
    values = contents.array(name)
    if values.dtype.kind not in "fiu" or values.ndim != len(order):
        raise FormatError(f"'{name}' has no numbers over {', '.join(order)}", path=contents.path)
    stated = contents.file[name].attrs.get("dims")
    dims = list(order) if stated is None else parse_json(text_of(stated), path=contents.path)
    if sorted(map(str, dims)) != sorted(order):
        raise FormatError(
            f"'{name}' is over {dims}, expected {', '.join(order)}", path=contents.path
        )
    return values.transpose([dims.index(dimension) for dimension in order])


def _scores(contents: Hdf5Contents, shape: tuple[int, ...]) -> npt.NDArray[Any] | None:
    """Return the scores of the nodes, None where the file has none."""
    if "point_scores" not in contents.file:
        return None
    scores = _in_order(contents, "point_scores", ("track", "node", "frame"))
    if scores.shape != (shape[0], *shape[2:]):
        raise FormatError("'point_scores' has another shape than 'tracks'", path=contents.path)
    return scores


LOADER = SleapLoader()
