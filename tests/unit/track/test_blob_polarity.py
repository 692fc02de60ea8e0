"""Whether blobs are dark or bright, learned from a few frames."""

from __future__ import annotations

import numpy as np
import pytest

from driftwalk.track.detect.blobs import usual_polarity


def frames(levels: list[int], sides: list[int]) -> tuple[list[np.ndarray], np.ndarray]:
    """Return frames with squares of these levels and sides, and the grey background."""
    random = np.random.default_rng(0)
    background = np.full((120, 160, 3), 120, np.uint8)
    images = []
    for index, (level, side) in enumerate(zip(levels, sides, strict=True)):
        image = background + random.integers(0, 5, background.shape).astype(np.uint8)
        left = 10 + 12 * (index % 10)
        image[30 : 30 + side, left : left + side] = level
        images.append(image)
    return images, background


@pytest.mark.parametrize(
    ("levels", "expected"),
    [([20] * 9, "dark"), ([230] * 9, "bright"), ([20, 230, 20, 230], "both"), ([120] * 5, "both")],
)
def test_the_majority_counts(levels: list[int], expected: str) -> None:
    assert usual_polarity(*frames(levels, [12] * len(levels))) == expected


def test_a_larger_bright_thing_in_a_few_frames_does_not() -> None:
    """A dark object; something bright and ten times as large moves beside it now and then."""
    images, background = frames([20] * 10, [10] * 10)
    for image in images[:3]:
        image[70:102, 100:132] = 240
    assert usual_polarity(images, background) == "dark"
