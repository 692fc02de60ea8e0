"""Propose a marker description from sample frames: two colours, size and spacing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.core.extras import require_opencv
from driftwalk.core.units import in_percent
from driftwalk.track.detect.markers import (
    LEAST_HUE_DIFFERENCE,
    ChromaTables,
    MarkerColour,
    TwoColourMarker,
    hue_difference,
)
from driftwalk.track.detect.two_colour_detector import Disc, find_regions
from driftwalk.track.types import Image, PixelToWorld


class TeachPolicy(NamedTuple):
    """Which colours of an image are proposed as a marker's."""

    bins: int = 72
    """Bins of the histogram of hues; chosen by hand."""
    least_chroma: float = 14.0
    """Chroma above which a pixel is coloured [CIELAB]; chosen by hand."""
    least_share: float = 5e-5
    """Least share of the pixels that a colour must have; chosen by hand."""
    peak_share: float = 0.03
    """Least height of a peak of the histogram, as a share of the highest; chosen by hand."""
    most_colours: int = 5
    """Colours that are tried, the most frequent first; chosen by hand."""
    least_area_px: float = 12.0
    """Least area of a disc [px^2]; chosen by hand."""
    round: float = 0.6
    """Least share of its bounding box that a disc fills, and least ratio of its sides; chosen
    by hand."""
    hue_deg: float = 20.0
    """Hues about a peak that are one colour [degrees]; chosen by hand."""
    inner: float = 0.8
    """Part of the strong chroma (its 90 % quantile) above which a pixel is within a disc; chosen by
    hand."""
    spacing_off: float = 0.15
    """Share of the usual spacing by which that of a pair may differ; chosen by hand."""
    size_off: float = 0.25
    """Share of the usual diameter by which that of a pair may differ; chosen by hand."""
    nearest: float = 0.8
    """Least spacing of two discs, in diameters; chosen by hand."""
    farthest: float = 6.0
    """Largest spacing of two discs, in diameters; chosen by hand."""


_TEACH: Final = TeachPolicy()

_NAMES: Final = (
    ("red", 25.0),
    ("orange", 60.0),
    ("yellow", 95.0),
    ("green", 150.0),
    ("cyan", 200.0),
    ("blue", 285.0),
    ("magenta", 330.0),
)
"""Hue of each colour in CIELAB [degrees]; the nearest names a disc."""


@dataclass(frozen=True)
class ColourSeen:
    """A colour that stands out in images.

    Parameters
    ----------
    colour : MarkerColour
        Its mean and spread.
    share : float
        Share of the pixels that have it.
    name : str
        The colour in a word.
    """

    colour: MarkerColour
    share: float
    name: str

    def __str__(self) -> str:
        """Return the colour with its numbers."""
        a, b = self.colour.a_star, self.colour.b_star
        share = in_percent(self.share, decimals=2)
        return f"{self.name} (a* {a:.0f}, b* {b:.0f}; {share} of the image)"


@dataclass(frozen=True, eq=False)
class MarkerProposal:
    """A marker as it was found.

    Parameters
    ----------
    marker : TwoColourMarker
        The marker to write to ``markers.toml``. Which disc is the first is not seen: it is the one
        whose hue comes first, counted from red.
    pairs : int
        Pairs of discs from which size and spacing were measured.
    colours : list of ColourSeen
        All colours that stood out.
    picture : array, shape (rows, columns, 3)
        The first frame with the discs and pairs drawn in.
    """

    marker: TwoColourMarker
    pairs: int
    colours: list[ColourSeen]
    picture: Image


def colours_seen(images: Sequence[Image]) -> list[ColourSeen]:
    """Return the colours that stand out in images, the most frequent first.

    Parameters
    ----------
    images : sequence of array, shape (rows, columns, 3)
        A few frames.

    Returns
    -------
    list of ColourSeen
        At most five; none when all is grey.

    Examples
    --------
    >>> import numpy as np
    >>> image = np.full((40, 40, 3), 90, np.uint8)
    >>> image[5:15, 5:15] = (40, 40, 220)
    >>> [seen.name for seen in colours_seen([image])]
    ['red']
    """
    a_star, b_star = _chroma(require_opencv(), images)
    chroma = np.hypot(a_star, b_star)
    coloured = chroma > _TEACH.least_chroma
    hue = np.arctan2(b_star[coloured], a_star[coloured])
    counts, _ = np.histogram(hue, _TEACH.bins, (-math.pi, math.pi), weights=chroma[coloured])
    # Around the circle, with the next two bins on each side.
    smooth = np.sum([np.roll(counts, k) * (3 - abs(k)) for k in range(-2, 3)], axis=0) / 9.0
    peak = (smooth >= np.roll(smooth, 1)) & (smooth > np.roll(smooth, -1))
    peak &= smooth > _TEACH.peak_share * smooth.max(initial=0.0)
    found = []
    for index in np.flatnonzero(peak):
        centre = (index + 0.5) * 2 * math.pi / _TEACH.bins - math.pi
        near = np.abs(np.angle(np.exp(1j * (hue - centre)))) < math.radians(_TEACH.hue_deg)
        seen = _describe(a_star[coloured][near], b_star[coloured][near], chroma.size)
        if seen is not None:
            found.append(seen)
    found.sort(key=lambda item: -item.share)
    return found[: _TEACH.most_colours]


def missing_colours(marker: TwoColourMarker, images: Sequence[Image]) -> str | None:
    """Say which of a marker's colours never appears in images, and which colours do.

    Parameters
    ----------
    marker : TwoColourMarker
        The marker.
    images : sequence of array, shape (rows, columns, 3)
        A few frames.

    Returns
    -------
    str or None
        A sentence; None when both colours are there.

    Examples
    --------
    >>> import numpy as np
    >>> marker = TwoColourMarker(
    ...     spacing_m=0.014, size_m=0.010,
    ...     colour_1={"a_star": 60, "b_star": 14}, colour_2={"a_star": -44, "b_star": 24},
    ... )
    >>> missing_colours(marker, [np.full((9, 9, 3), 90, np.uint8)])
    'colour 1 (red) and colour 2 (green) never appear; no colour stands out: all is grey'
    """
    cv2 = require_opencv()
    tables = ChromaTables(marker)
    counts = np.zeros(3)
    for image in images:
        # Without its noise: single pixels of any colour are in every image.
        calm = cv2.GaussianBlur(image, (0, 0), 2.0)
        counts += np.bincount(tables.label[tables.codes(cv2, calm)].ravel(), minlength=3)[:3]
    pair = (marker.colour_1, marker.colour_2)
    absent = [
        f"colour {number} ({_name(colour.hue_rad)})"
        for number, colour in enumerate(pair, start=1)
        if counts[number] < _TEACH.least_area_px
    ]
    if not absent:
        return None
    seen = ", ".join(map(str, colours_seen(images)))
    instead = f"seen instead: {seen}" if seen else "no colour stands out: all is grey"
    return f"{' and '.join(absent)} never appear{'s' if len(absent) == 1 else ''}; {instead}"


def propose_markers(
    images: Sequence[Image], camera: PixelToWorld, *, block_side: float | None = None
) -> MarkerProposal:
    """Propose a two-colour marker from a few frames.

    Of the colours that stand out, the two are taken whose regions are round, of one size, and most
    often found as pairs at one distance.

    Parameters
    ----------
    images : sequence of array, shape (rows, columns, 3)
        A few frames, spread over the video.
    camera : PixelToWorld
        The scale.
    block_side : float, optional
        Side of the blocks [m], to be written into the file.

    Returns
    -------
    MarkerProposal
        The marker, and a picture of what was found.

    Raises
    ------
    InputError
        When there are no two colours that make pairs; the message says what was seen.

    Examples
    --------
    >>> import driftwalk as dw
    >>> track = dw.tank30_recording("without_noise").isel(time=slice(0, 1))
    >>> _, image = next(dw.render_video(track))
    >>> camera = dw.track.Camera.from_scale(640, 480, px_per_m=1500.0)
    >>> round(propose_markers([image], camera).marker.spacing_m, 4)
    0.014
    """
    cv2 = require_opencv()
    seen = colours_seen(images)
    best: tuple[int, float, TwoColourMarker, list[tuple[int, Disc, Disc]]] | None = None
    for first, second in combinations(seen, 2):
        ordered = sorted((first.colour, second.colour), key=lambda c: c.hue_rad % (2 * math.pi))
        if hue_difference(*ordered) < LEAST_HUE_DIFFERENCE:
            continue
        tried = _measure(cv2, images, camera, ordered, block_side)
        if tried is not None and (best is None or (tried[0], -tried[1]) > (best[0], -best[1])):
            best = tried
    if best is None:
        what = ", ".join(map(str, seen)) if seen else "all is grey"
        raise InputError(
            f"no two colours were found whose discs form pairs at one distance; seen: {what}"
        )
    number, _, marker, pairs = best
    return MarkerProposal(marker, number, seen, _picture(cv2, images[0], pairs))


def _measure(
    cv2: Any,
    images: Sequence[Image],
    camera: PixelToWorld,
    colours: list[MarkerColour],
    block_side: float | None,
) -> tuple[int, float, TwoColourMarker, list[tuple[int, Disc, Disc]]] | None:
    """Return pairs, scatter of their distance, and the marker; None without pairs."""
    tables = ChromaTables(
        TwoColourMarker(spacing_m=1.0, size_m=1.0, colour_1=colours[0], colour_2=colours[1])
    )
    pairs, distances, diameters = [], [], []
    for index, image in enumerate(images):
        label = tables.label[tables.codes(cv2, image)]
        found = (find_regions(cv2, label, k, 1, diameter_at=_least_diameters) for k in (1, 2))
        both = [[disc for disc in regions if _is_round(disc)] for regions in found]
        for one, two in _mutual(both[0], both[1]):
            ends = camera.to_world(np.array([[one.column, one.row], [two.column, two.row]]))
            scale = 1.0 / np.sqrt(np.abs(np.linalg.det(camera.jacobian(_places([one, two])))))
            distances.append(float(np.hypot(*(ends[1] - ends[0]))))
            sizes = [2 * math.sqrt(d.area / math.pi) for d in (one, two)]
            diameters.append(float(np.mean(sizes / scale)))
            pairs.append((index, one, two))
    if not pairs:
        return None
    apart, across = np.array(distances), np.array(diameters)
    spacing, size = float(np.median(apart)), float(np.median(across))
    agree = np.abs(apart - spacing) < _TEACH.spacing_off * spacing
    agree &= np.abs(across - size) < _TEACH.size_off * size
    number = int(agree.sum())
    nearest, farthest = _TEACH.nearest * size, _TEACH.farthest * size
    if number * 2 < len(pairs) or not nearest <= spacing <= farthest:
        return None
    marker = TwoColourMarker(
        # To a hundredth of a millimetre.
        spacing_m=round(float(apart[agree].mean()), 5),
        size_m=round(float(across[agree].mean()), 5),
        block_side_m=block_side,
        colour_1=colours[0],
        colour_2=colours[1],
    )
    chosen = [pair for pair, good in zip(pairs, agree, strict=True) if good]
    return number, float(apart[agree].std()) / spacing, marker, chosen


def _mutual(first: list[Disc], second: list[Disc]) -> list[tuple[Disc, Disc]]:
    """Return discs of both colours that are each other's nearest."""
    if not first or not second:
        return []
    a, b = _places(first), _places(second)
    apart = np.hypot(*(a[:, None] - b[None]).transpose(2, 0, 1))
    to_second, to_first = apart.argmin(axis=1), apart.argmin(axis=0)
    return [(first[i], second[j]) for i, j in enumerate(to_second) if to_first[j] == i]


def _least_diameters(places: Floats) -> Floats:
    """Return the least diameter of a disc, as long as the true one is not known [px]."""
    return np.full(len(places), 2.0 * math.sqrt(_TEACH.least_area_px / math.pi))


def _places(discs: list[Disc]) -> Floats:
    return np.array([[disc.column, disc.row] for disc in discs])


def _is_round(disc: Disc) -> bool:
    width, height = disc.box[2] - disc.box[0] + 1, disc.box[3] - disc.box[1] + 1
    long, short = max(width, height), min(width, height)
    return (
        disc.area >= _TEACH.least_area_px
        and disc.area > _TEACH.round * width * height
        and short > _TEACH.round * long
    )


def _chroma(cv2: Any, images: Sequence[Image]) -> tuple[Floats, Floats]:
    """Return a* and b* of all pixels of images, noise smoothed."""
    parts = []
    for image in images:
        lab = cv2.cvtColor(cv2.GaussianBlur(image, (0, 0), 1.0), cv2.COLOR_BGR2Lab)
        parts.append(lab[..., 1:].reshape(-1, 2).astype(np.float64) - 128.0)
    together = np.concatenate(parts)
    return together[:, 0], together[:, 1]


def _describe(a_star: Floats, b_star: Floats, pixels: int) -> ColourSeen | None:
    """Return the colour of the inner pixels of what has one hue."""
    chroma = np.hypot(a_star, b_star)
    if a_star.size < max(_TEACH.least_share * pixels, _TEACH.least_area_px):
        return None
    # Edges are mixed with their surroundings; the strongest colour is the disc's own.
    inner = chroma > _TEACH.inner * np.quantile(chroma, 0.9)
    a, b = float(np.median(a_star[inner])), float(np.median(b_star[inner]))
    spread = float(np.clip(np.hypot(a_star[inner] - a, b_star[inner] - b).std(), 2.0, 20.0))
    colour = MarkerColour(a_star=round(a, 1), b_star=round(b, 1), spread=round(spread, 1))
    return ColourSeen(colour, a_star.size / pixels, _name(colour.hue_rad))


def _name(hue_rad: float) -> str:

    def off(degrees: float) -> float:
        return abs(math.remainder(hue_rad - math.radians(degrees), 2 * math.pi))

    return min(_NAMES, key=lambda item: off(item[1]))[0]


def _picture(cv2: Any, image: Image, pairs: list[tuple[int, Disc, Disc]]) -> Image:
    picture = image.copy()
    for index, one, two in pairs:
        if index == 0:
            ends = [(round(d.column), round(d.row)) for d in (one, two)]
            cv2.line(picture, *ends, (255, 255, 255), 1, cv2.LINE_AA)
            for disc, end, name in zip((one, two), ends, "12", strict=True):
                radius = max(round(math.sqrt(disc.area / math.pi)) + 2, 3)
                cv2.circle(picture, end, radius, (255, 255, 255), 1, cv2.LINE_AA)
                at = (end[0] + radius + 1, end[1] - radius)
                cv2.putText(picture, name, at, cv2.FONT_HERSHEY_SIMPLEX, 0.4, (255, 255, 255), 1)
    return picture
