"""Coverage of a fit to the part of a track that is seen in a quarter of the tank.

    python studies/outcomes/window.py [RECORDINGS]        (some ten seconds of processor time each)

One block for 20 minutes in the bundled flow, C_d 0.45 and sigma_F 0.55 mN, 0.3 mm and 0.5 degrees
of noise in the study of the fit. Prints which 90 % intervals of C_d and sigma_F hold.
"""

from __future__ import annotations

import sys

import numpy as np

import driftwalk as dw
from driftwalk.schema import build_trajectory

TRUTH = {"drag_coefficient": 0.45, "force_std": 5.5e-4}
STUDY = dw.Study(
    forces={"drag_coefficient": 0.45, "force_std_N": 5.5e-4, "force_interval_s": 0.016},
    observation={"position_noise_m": 3e-4, "orientation_noise_rad": "0.5deg"},
    fit={"spline_spacing_m": 0.03},
)


def main(recordings: int) -> None:
    """Simulate, and fit the window and the whole."""
    clock = 0.1 * np.arange(12001)
    run = dw.simulate(STUDY, dw.tank30_flow(), sample_time=clock, replicates=16, seed=5)
    for number in range(recordings):
        pose = {n: run[n].values[number, :, 0].astype(float) for n in ("x", "y", "theta")}
        whole = build_trajectory(clock, **pose)
        seen = (whole["x"] > 0) & (whole["y"] > 0)
        window = whole.assign({name: whole[name].where(seen) for name in pose})
        for words, track, flow in (
            ("window", window, None),
            ("window, flow known", window, dw.tank30_flow()),
            ("whole", whole, None),
        ):
            fit = dw.fit_motion(track, STUDY, flow=flow)
            ends = fit["interval"].sel(parameter=list(TRUTH)).values
            held = [low <= at <= high for at, (low, high) in zip(TRUTH.values(), ends, strict=True)]
            print(number, words, dict(zip(TRUTH, held, strict=True)), ends.tolist(), flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 13)
