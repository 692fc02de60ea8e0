"""Draw a frame of each level with what is found in it, side by side.

    python studies/tracking/picture.py OUT PICTURE.jpg

OUT is that of run.py, with the videos kept (`--keep-videos`) of one scene.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from commands import driftwalk

FRAME: Final = 94
SEED: Final = 101
SCALE: Final = 0.75


def main() -> None:
    """Draw both frames, and put them beside each other."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("picture", type=Path)
    options = parser.parse_args()
    parts = []
    for level in ("moderate", "heavy"):
        name = f"{level}-{SEED}"
        words = (options.out / "videos" / f"{name}.mkv", "--tank", "30cm")
        markers = options.out / "recordings" / f"{name}.toml"
        target = options.out / f"{name}.nc"
        driftwalk(
            "track", *words, "--markers", markers, "--explain", FRAME, "-o", target, "--overwrite"
        )
        image = cv2.imread(str(target.with_name(f"{name}-frame-{FRAME}.png")))
        parts.append(cv2.resize(image, None, fx=SCALE, fy=SCALE, interpolation=cv2.INTER_AREA))
    cv2.imwrite(str(options.picture), np.hstack(parts), [cv2.IMWRITE_JPEG_QUALITY, 80])


if __name__ == "__main__":
    main()
