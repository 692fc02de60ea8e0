"""Draw where a finished calibration fails: python picture.py RUN FIGURE.png [BODY].

RUN is a run directory of `driftwalk calibrate`. The optimum is simulated 16 times more. The figure
shows the densities of the recording's steps, of the simulated ones, and the place of the largest
difference; the same is printed in words.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from driftwalk.calibration.problem import Problem, prepare_problem, score_settings
from driftwalk.conditions import recorded_camera
from driftwalk.model import parse_study
from driftwalk.plot.parts.labels import ANGLE_LABEL, LENGTH_LABEL
from driftwalk.plot.parts.style import (
    DOUBLE_COLUMN_MM,
    INK,
    ORANGE,
    add_colorbar,
    letter_panels,
    new_figure,
    print_style,
)
from driftwalk.plot.step_densities import DENSITY_LABEL, density_mesh, density_of
from driftwalk.schema import body_track
from driftwalk.schema.answers.facts import fitted_value
from driftwalk.schema.stores.netcdf import open_netcdf

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = npt.NDArray[np.float64]
REPLICATES = 16
QUANTILES = (0.1, 0.5, 0.9)
DPI = 130


class Fit(NamedTuple):
    """Steps of the recording and of simulations at the optimum, shape (n, 2): m and rad."""

    recorded: Floats
    simulated: Floats
    place: tuple[float, float]
    """Step length [m] and turning angle [rad] of the largest difference of shares."""
    quadrant: int
    """Bit 0: longer steps than at the place, bit 1: larger angles."""

    def shares(self) -> tuple[float, float]:
        """Return the shares of the recorded and of the simulated steps in that quadrant."""
        length, angle = self.place
        shares = []
        for steps in (self.recorded, self.simulated):
            along = steps[:, 0] > length if self.quadrant & 1 else steps[:, 0] < length
            around = steps[:, 1] > angle if self.quadrant & 2 else steps[:, 1] < angle
            shares.append(float((along & around).mean()))
        return shares[0], shares[1]


def simulate_optimum(run: Path, body: str | None) -> tuple[Fit, Problem]:
    """Simulate the optimum of a run; the place is that of the replicate with the median D."""
    found = open_netcdf(run / "calibration.nc")
    recording = xr.open_dataset(run / "recording.nc")
    study = parse_study(found.attrs["study"])
    track = body_track(recording, body)
    quantum = float(recording.attrs.get("position_quantum_m", 0.0))
    camera = recorded_camera(track, study, position_quantum=quantum)
    flow = xr.open_dataset(run / "flow.nc")
    problem = prepare_problem(track, study, flow, camera=camera)
    optimum = fitted_value(found, "drag_coefficient"), fitted_value(found, "force_std")
    scored = score_settings(
        problem, optimum, stage="floor", numbers=[1], replicates=range(REPLICATES), details="steps"
    )
    middle = int(np.argsort(scored["ks_distance"])[REPLICATES // 2])
    steps = [
        np.column_stack([scored["step_length"][i, :pairs], scored["turning_angle"][i, :pairs]])
        for i, pairs in enumerate(scored["pairs"])
    ]
    place = float(scored["ks_step_length"][middle]), float(scored["ks_turning_angle"][middle])
    fit = Fit(problem.steps, np.concatenate(steps), place, int(scored["ks_quadrant"][middle]))
    return fit, problem


def draw(fit: Fit, problem: Problem, name: str, file: Path) -> None:
    """Write the figure."""
    length = 1e3 * np.linspace(0.0, problem.reference.length_limit, 33)
    angle = np.degrees(
        np.linspace(-problem.reference.angle_limit, problem.reference.angle_limit, 33)
    )
    shares = [_histogram(steps, length, angle) for steps in (fit.recorded, fit.simulated)]
    top = max(float(density_of(share, length, angle).max()) for share in shares)
    with print_style():
        figure = new_figure(width_mm=DOUBLE_COLUMN_MM, height_mm=66.0)
        axes: list[Axes] = list(figure.subplots(1, 2, sharex=True, sharey=True))
        for ax, share in zip(axes, shares, strict=True):
            mesh = density_mesh(ax, share, length, angle, top=top)
            _mark(ax, fit, (length[-1], angle[0], angle[-1]))
            ax.set(xlabel=LENGTH_LABEL, ylabel=ANGLE_LABEL)
            ax.label_outer()
        real, simulated = fit.shares()
        titles = [
            f"{name}: {100 * real:.0f} % in the frame",
            f"optimum: {100 * simulated:.0f} % in the frame",
        ]
        letter_panels(axes, titles)
        add_colorbar(mesh, axes, DENSITY_LABEL)
        figure.savefig(file, dpi=DPI, metadata={"Software": None})


def _histogram(steps: Floats, length_mm: Floats, angle_deg: Floats) -> Floats:
    counts = np.histogram2d(1e3 * steps[:, 0], np.degrees(steps[:, 1]), [length_mm, angle_deg])[0]
    return np.asarray(counts / len(steps))


def _mark(ax: Axes, fit: Fit, ends: tuple[float, float, float]) -> None:
    """Frame the quadrant in which the shares differ most."""
    longest, lowest, highest = ends
    length, angle = 1e3 * fit.place[0], float(np.degrees(fit.place[1]))
    x = (length, longest) if fit.quadrant & 1 else (0.0, length)
    y = (angle, highest) if fit.quadrant & 2 else (lowest, angle)
    corners = [x[0], x[1], x[1], x[0], x[0]], [y[0], y[0], y[1], y[1], y[0]]
    ax.plot(*corners, color=INK, linewidth=2.4, clip_on=False)
    ax.plot(*corners, color=ORANGE, linewidth=1.4, clip_on=False)


def describe(fit: Fit) -> dict[str, Any]:
    """Return the place of the largest difference and the quantiles of both, in mm and degrees."""
    real, simulated = fit.shares()
    sense = "longer" if fit.quadrant & 1 else "shorter", "above" if fit.quadrant & 2 else "below"
    scale = np.array([1e3, 180.0 / np.pi])
    quantiles = {
        name: (np.quantile(steps, QUANTILES, axis=0) * scale).T.round(2).tolist()
        for name, steps in (("recorded", fit.recorded), ("simulated", fit.simulated))
    }
    return {
        "place": f"{sense[0]} than {1e3 * fit.place[0]:.3g} mm, "
        f"{sense[1]} {np.degrees(fit.place[1]):.0f} degrees",
        "share_recorded": round(real, 3),
        "share_simulated": round(simulated, 3),
        "quantiles_mm_deg_10_50_90": quantiles,
    }


def main(run: str, file: str, body: str | None = None) -> None:
    """Draw the figure of a run and print it in words."""
    fit, problem = simulate_optimum(Path(run), body)
    draw(fit, problem, Path(run).name, Path(file))
    print(json.dumps({Path(run).name: describe(fit)}))


if __name__ == "__main__":
    main(*sys.argv[1:])
