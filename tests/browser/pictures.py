"""What a picture on a page shows, read back: pixels, and the numbers behind a drawn path."""

from __future__ import annotations

import io
import re
from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


def pixels(locator: Any) -> Floats:
    """Return the pixels of an element as the browser shows it, (rows, columns, 3)."""
    from matplotlib.image import imread

    return np.asarray(imread(io.BytesIO(locator.screenshot())))[..., :3]


def drawn_share(picture: Floats) -> float:
    """Return the share of pixels that differ from the most frequent colour."""
    flat = np.round(255 * picture.reshape(-1, 3)).astype(np.int64) @ [1, 256, 65536]
    return 1.0 - np.unique(flat, return_counts=True)[1].max() / flat.size


def path_points(locator: Any) -> Floats:
    """Return the corners of a drawn path [px], (n, 2)."""
    numbers = re.findall(r"-?\d+(?:\.\d+)?(?:e-?\d+)?", locator.get_attribute("d"))
    return np.array(numbers, dtype=np.float64).reshape(-1, 2)


def assert_same_path(points: Floats, x: Floats, y: Floats, *, within_px: float = 1.0) -> None:
    """Check that a drawn path is x, y but for one scale, the same both ways, and y turned down."""
    assert len(points) == len(x)
    (scale, left), (down, top) = (
        np.polyfit(values, points[:, part], 1) for part, values in enumerate((x, y))
    )
    assert scale > 0
    assert down == -scale or abs(down + scale) < 0.02 * scale
    for part, values, slope, begin in ((0, x, scale, left), (1, y, down, top)):
        assert np.abs(slope * values + begin - points[:, part]).max() < within_px
