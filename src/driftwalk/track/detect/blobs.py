"""Single dark or bright objects before a still background: position without orientation."""

from __future__ import annotations

from typing import Any, Final, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import InputError
from driftwalk.core.extras import require_opencv
from driftwalk.track.types import Detection, Image, PixelToWorld, Rejected

Polarity = Literal["dark", "bright", "both"]
"""Brightness of objects, compared with their background."""

_EITHER: Final[tuple[Polarity, Polarity]] = ("dark", "bright")


class BlobPolicy(NamedTuple):
    """Which regions before a still background are objects."""

    noise_factor: float = 6.0
    """Contrast of an object, in standard deviations of the noise; chosen by hand."""
    least_contrast: float = 12.0
    """Least contrast of an object [grey levels]; chosen by hand."""
    share_of_peak: float = 0.35
    """Least contrast of an object, as a share of the highest in the image; chosen by hand."""
    position_std_px: float = 0.1
    """Standard deviation of a centre, per axis [px]; chosen by hand."""
    speck_px: float = 4.0
    """Area below which a region is not mentioned [px^2]; chosen by hand."""


_BLOBS: Final = BlobPolicy()


def median_background(images: list[Image]) -> Image:
    """Return the median of images, which shows the still background.

    Parameters
    ----------
    images : list of array, shape (rows, columns, 3)
        Spread over the video, so that the object is elsewhere in most of them.

    Returns
    -------
    array, shape (rows, columns, 3)
        The background, uint8.

    Raises
    ------
    InputError
        When there are fewer than three.

    Examples
    --------
    >>> import numpy as np
    >>> frames = [np.full((2, 2, 3), level, np.uint8) for level in (10, 200, 12)]
    >>> int(median_background(frames)[0, 0, 0])
    12
    """
    if len(images) < 3:
        raise InputError(f"a background needs 3 images or more, there are {len(images)}")
    return np.asarray(np.median(np.stack(images), axis=0), dtype=np.uint8)


def usual_polarity(images: list[Image], background: Image) -> Polarity:
    """Return whether the largest object is dark or bright in most images.

    Something else that moves now and then, larger than the objects, is not what is looked for.

    Parameters
    ----------
    images : list of array, shape (rows, columns, 3)
        Spread over the video.
    background : array, shape (rows, columns, 3)
        See `median_background`.

    Returns
    -------
    {"dark", "bright", "both"}
        "both" when neither holds for two thirds of the images in which there is an object.

    Examples
    --------
    >>> import numpy as np
    >>> background = np.full((60, 80, 3), 200, np.uint8)
    >>> images = [background.copy() for _ in range(3)]
    >>> for step, image in enumerate(images):
    ...     image[20:31, 20 + 10 * step : 30 + 10 * step] = 30
    >>> usual_polarity(images, background)
    'dark'
    """
    detectors = [BlobDetector(background, polarity=one, objects=1) for one in _EITHER]
    votes = []
    for image in images:
        found = [detector.detect(image)[0] for detector in detectors]
        dark, bright = (one[0].area_px if one else 0.0 for one in found)
        if dark != bright:
            votes.append(dark > bright)
    if not votes:
        return "both"
    share = sum(votes) / len(votes)
    return "dark" if share >= 2 / 3 else "bright" if share <= 1 / 3 else "both"


class BlobDetector:
    """Finds objects that are darker or brighter than a still background.

    Parameters
    ----------
    background : array, shape (rows, columns, 3)
        See `median_background`.
    camera : PixelToWorld, optional
        The scale; without it detections are in pixels.
    polarity : {"dark", "bright", "both"}
        Brightness of the objects, compared with the background.
    least_area_px : float
        Smallest area of an object [px²].
    most_area_px : float, optional
        Largest area [px²].
    objects : int, optional
        How many there are: the largest ones are kept.
    contrast : float, optional
        Least difference in grey, of 255; from the noise of each image when left out.

    Raises
    ------
    InputError
        When the polarity is none of the three.

    Examples
    --------
    >>> import numpy as np
    >>> background = np.full((60, 80, 3), 200, np.uint8)
    >>> image = background.copy()
    >>> image[20:31, 40:51] = 30
    >>> found, _ = BlobDetector(background, polarity="dark").detect(image)
    >>> round(found[0].column), round(found[0].row)
    (45, 25)
    """

    def __init__(
        self,
        background: Image,
        camera: PixelToWorld | None = None,
        *,
        polarity: Polarity = "both",
        least_area_px: float = 30.0,
        most_area_px: float | None = None,
        objects: int | None = None,
        contrast: float | None = None,
    ) -> None:
        if polarity not in ("dark", "bright", "both"):
            raise InputError(f"a blob is dark, bright or both, not '{polarity}'")
        self._cv2: Any = require_opencv()
        self._background = self._grey(background)
        self.camera, self._polarity = camera, polarity
        self._least, self._most, self._objects = least_area_px, most_area_px, objects
        self._contrast = contrast

    def detect(self, image: Image) -> tuple[list[Detection], list[Rejected]]:
        """Find the objects in one image.

        Parameters
        ----------
        image : array, shape (rows, columns, 3)
            Blue, green, red, uint8; of the background's size.

        Returns
        -------
        tuple
            Detections, and rejected candidates with the reason.
        """
        cv2 = self._cv2
        difference = self._difference(image)
        mask = np.greater(difference, self._limit(difference)).view(np.uint8)
        count, label, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
        areas = stats[1:, cv2.CC_STAT_AREA]
        kept, rejected = [], []
        for index in range(1, count):
            box = tuple(int(value) for value in stats[index, :4])
            area = float(areas[index - 1])
            if area < _BLOBS.speck_px:
                continue
            column, row = _centre(difference, label, index, box)
            if area < self._least:
                text = f"too small: {area:.0f} px², at least {self._least:.0f}"
                rejected.append(Rejected(column, row, area, text, "too small"))
            elif self._most is not None and area > self._most:
                text = f"too large: {area:.0f} px², at most {self._most:.0f}"
                rejected.append(Rejected(column, row, area, text, "too large"))
            else:
                kept.append((area, column, row))
        kept.sort(reverse=True)
        if self._objects is not None:
            for area, column, row in kept[self._objects :]:
                text = f"smaller than the {self._objects} largest"
                rejected.append(Rejected(column, row, area, text, "surplus"))
            kept = kept[: self._objects]
        return self._place(kept), rejected

    def _grey(self, image: Image) -> npt.NDArray[np.uint8]:
        grey = self._cv2.cvtColor(image, self._cv2.COLOR_BGR2GRAY)
        return np.asarray(self._cv2.GaussianBlur(grey, (5, 5), 0), dtype=np.uint8)

    def _difference(self, image: Image) -> npt.NDArray[np.uint8]:
        grey = self._grey(image)
        if grey.shape != self._background.shape:
            raise InputError(
                f"the image is {grey.shape[1]} x {grey.shape[0]} pixels, its background "
                f"{self._background.shape[1]} x {self._background.shape[0]}"
            )
        if self._polarity == "dark":
            return np.asarray(self._cv2.subtract(self._background, grey), dtype=np.uint8)
        if self._polarity == "bright":
            return np.asarray(self._cv2.subtract(grey, self._background), dtype=np.uint8)
        return np.asarray(self._cv2.absdiff(grey, self._background), dtype=np.uint8)

    def _limit(self, difference: npt.NDArray[np.uint8]) -> float:
        """Return the least difference that is no noise."""
        if self._contrast is not None:
            return self._contrast
        total = np.cumsum(np.bincount(difference[::4, ::4].ravel(), minlength=256))
        noise = float(np.searchsorted(total, 0.84 * total[-1]))
        peak = float(np.searchsorted(total, total[-1] - max(self._least / 32.0, 1.0)))
        return max(_BLOBS.least_contrast, _BLOBS.noise_factor * noise, _BLOBS.share_of_peak * peak)

    def _place(self, kept: list[tuple[float, float, float]]) -> list[Detection]:
        if not kept:
            return []
        pixels = np.array([[column, row] for _, column, row in kept])
        in_pixels = np.stack([np.diag([_BLOBS.position_std_px**2] * 2)] * len(kept))
        places: list[Any] = [(None, None)] * len(kept)
        if self.camera is not None:
            places = self.camera.to_world(pixels).tolist()
            slopes = self.camera.jacobian(pixels)
            in_pixels = slopes @ in_pixels @ slopes.transpose(0, 2, 1)
        found = []
        for (area, column, row), (x, y), spread in zip(kept, places, in_pixels, strict=True):
            covariance = np.full((3, 3), np.nan)
            covariance[:2, :2] = spread
            found.append(Detection(x, y, column, row, float("nan"), covariance, area))
        return found


def _centre(
    difference: Image, label: npt.NDArray[np.int32], index: int, box: tuple[int, ...]
) -> tuple[float, float]:
    """Return the mean place of a region, weighted by its contrast."""
    left, top, width, height = box
    part = np.s_[top : top + height, left : left + width]
    weight = np.where(label[part] == index, difference[part], 0).astype(np.float64)
    total = weight.sum()
    column = left + float(weight.sum(axis=0) @ np.arange(width)) / total
    row = top + float(weight.sum(axis=1) @ np.arange(height)) / total
    return column, row
