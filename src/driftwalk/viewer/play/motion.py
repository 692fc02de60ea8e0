"""Motion of the playground's blocks: steps of single blocks, next to those of a recording.

A block counts while it is alone: the steps of an assembly are another motion. Positions are taken
as the recording's camera would have: at its interval, with its noise and resolution.
"""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.comparison import (
    KsReference,
    apply_steps,
    block_permutation_test,
    joint_density,
    ks_reference,
    plan_steps,
    step_length_edges,
    turning_angle_edges,
)
from driftwalk.conditions import recorded_camera
from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.page import encode_array
from driftwalk.schema import body_track
from driftwalk.simulation.backend import Camera
from driftwalk.viewer.watch.recording_steps import RecordedSteps, recorded_steps

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


INTERVAL_S: Final = 0.1
"""Time between the points of a step where there is no recording [s]."""


class Beside(NamedTuple):
    """A recording that the blocks are compared with."""

    steps: RecordedSteps
    reference: KsReference
    camera: Camera


def beside(recording: xr.Dataset, study: Study, *, body: str | None = None) -> Beside:
    """Return a recording ready for comparison.

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    study : Study
        How steps are formed, and what is known of the camera.
    body : str, optional
        The body, where there are several.

    Raises
    ------
    InputError
        When no steps can be formed.
    """
    steps = recorded_steps(recording, study, body=body)
    quantum = float(recording.attrs.get("position_quantum_m", 0.0))
    camera = recorded_camera(body_track(recording, body), study, position_quantum=quantum)
    return Beside(steps, ks_reference(steps.points), camera)


class MotionWindow:
    """The last positions of single blocks, and the steps that they make.

    Parameters
    ----------
    recording : Beside or None
        The recording to compare the steps with.
    seed : int
        Of the camera's noise.
    """

    def __init__(self, recording: Beside | None, *, seed: int) -> None:
        self.interval = INTERVAL_S if recording is None else recording.steps.step_interval
        self._recording = recording
        self._camera = Camera() if recording is None else recording.camera
        self._random = np.random.default_rng(seed)
        self._lock = threading.Lock()
        self._floor: tuple[int, float | None] = (0, None)
        self._age = 0
        self.clear()

    def clear(self) -> None:
        """Forget everything: the steps to come are of other settings."""
        with self._lock:
            self._place = np.empty((0, 0, 2))
            self._count = 0
            self._floor = (0, None)
            self._age += 1

    def add(self, x: Floats, y: Floats, assembly: npt.NDArray[np.int32]) -> None:
        """Take the positions of all blocks at the next instant.

        Parameters
        ----------
        x, y : ndarray, shape (blocks,)
            Positions [m].
        assembly : ndarray of int, shape (blocks,)
            Equal numbers are joined.
        """
        single = np.bincount(assembly, minlength=x.size)[assembly] == 1
        place = np.stack([x, y], axis=1)
        place += self._camera.position_noise * self._random.standard_normal(place.shape)
        quantum = self._camera.position_quantum
        if quantum > 0.0:
            place = quantum * np.rint(place / quantum)
        place[~single] = np.nan
        with self._lock:
            if self._place.shape[1] != x.size:
                # Of all blocks together some 20,000 positions are kept.
                self._place = np.empty((max(20_000 // max(x.size, 1), 100), x.size, 2))
                self._count, self._floor = 0, (0, None)
            if self._count == len(self._place):
                # The older half goes.
                half = self._count // 2
                self._place[:half] = self._place[self._count - half :]
                self._count = half
            self._place[self._count] = place
            self._count += 1

    def points(self) -> Floats:
        """Return step lengths [m] and turning angles [rad], one block after the other, (n, 2)."""
        with self._lock:
            place = self._place[: self._count].copy()
        if len(place) < 3:
            return np.empty((0, 2))
        plan = plan_steps(self.interval * np.arange(len(place)), step_interval=self.interval)
        found = [apply_steps(plan, *place[:, block].T) for block in range(place.shape[1])]
        return np.concatenate(
            [np.column_stack([steps.step_length, steps.turning_angle]) for steps in found]
        )

    def message(self) -> dict[str, Any]:
        """Return the density of the steps, the recording's density, and their distance.

        The noise floor is the median distance when the blocks' and the recording's steps are
        shuffled: a distance this small shows no difference between them.
        """
        points = self.points()
        recording = self._recording
        if recording is None:
            lengths = step_length_edges(points[:, 0] if len(points) else [1.0])
            angles = turning_angle_edges()
        else:
            lengths, angles = recording.steps.length_edge, recording.steps.angle_edge
        density = np.zeros((lengths.size - 1, angles.size - 1))
        if len(points):
            density = joint_density(*points.T, step_length_edge=lengths, turning_angle_edge=angles)
        distance = floor = None
        # Fewer steps have no distance that means anything.
        if recording is not None and len(points) >= 30:
            distance, floor = recording.reference.distance(points), self._noise_floor(points)
        return {
            "type": "density",
            "simulated": encode_array(density),
            "recording": None if recording is None else encode_array(recording.steps.density()),
            "step_length_edges": lengths.tolist(),
            "turning_angle_edges": angles.tolist(),
            "ks_distance": distance,
            "noise_floor": floor,
            "steps": len(points),
        }

    def _noise_floor(self, points: Floats) -> float | None:
        """Return the noise floor; what was found for nearly as many steps is kept."""
        steps, floor = self._floor
        age = self._age
        # It is computed again when there are three tenths more steps.
        if len(points) <= 1.3 * steps or self._recording is None:
            return floor
        try:
            floor = block_permutation_test(
                points, self._recording.steps.points, permutations=19, seed=1
            ).noise_floor
        except InputError:
            # Too few steps for blocks that are long against the memory of the motion.
            floor = None
        if age == self._age:
            self._floor = (len(points), floor)
        return floor
