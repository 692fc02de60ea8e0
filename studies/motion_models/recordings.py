"""The eight real recordings, and the scale of each: the choices of `studies/real`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Final, NamedTuple

sys.path.append(str(Path(__file__).resolve().parents[1] / "likelihood"))

from lines import read_lines

__all__ = ["RECORDINGS", "Recording", "read_lines"]

REAL: Final = Path(__file__).resolve().parents[1] / "real"


class Recording(NamedTuple):
    """A recording: its file in the folder of the data, its study, its body."""

    file: str
    study: str
    body: str | None = None

    @property
    def study_file(self) -> Path:
        """Where the study is."""
        return REAL / f"{self.study}.toml"


_SMARTICLES: Final = "smarticles-rattling/destab_driveA_100pc_0_noisevar_10_randdur_600.csv"
RECORDINGS: Final = {
    "hexbug": Recording("hexbug-gatech/training_video1-centroid_data", "hexbug"),
    "rummynose": Recording(
        "rummynose-single-epfl/rummy_single_seven_trajectories.txt", "rummynose"
    ),
    "tenebrio": Recording("tenebrio-ubitrail/tenebrio_ubitrail.csv.gz", "tenebrio", "04"),
    "mouse": Recording("tracktor-mouse-termite/mouse_video_tracked.csv", "mouse"),
    "smarticle-1": Recording(_SMARTICLES, "smarticles", "1"),
    "smarticle-2": Recording(_SMARTICLES, "smarticles", "2"),
    "smarticle-3": Recording(_SMARTICLES, "smarticles", "3"),
    "termite": Recording("tracktor-mouse-termite/termite_video_tracked.csv", "termite", "D"),
}
