"""Tests that a motion model has to pass, for the test suites of those who write one.

Subclass `MotionModelContract` in a test file, and pytest runs it:

    class TestTumble(MotionModelContract):
        def model(self):
            return dw.motion_model(tumble, speed=(0, 0.1, "m/s"), tumble_rate=(0, 5, "1/s"))
"""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from driftwalk.comparison import StepDistance, step_table
from driftwalk.conditions import Conditions
from driftwalk.core.arrays import Floats, Keys
from driftwalk.core.random_streams import world_keys
from driftwalk.motion import MotionModel, ScoresItself, Worlds, score_worlds
from driftwalk.schema.trajectory import Track
from driftwalk.simulation.backend import STATUS, Camera
from driftwalk.simulation.initial import Start

if TYPE_CHECKING:
    import xarray as xr

WORLDS = 7
"""Worlds of a test: no power of two, so that a remainder of vector lanes is met too."""


class MotionModelContract:
    """Contract of every motion model: the promises of `driftwalk.motion.protocol`.

    Override `model`, and `conditions` where the model needs others: a flow, another tank.
    """

    def model(self) -> MotionModel:
        """Return the model under test."""
        raise NotImplementedError("return the motion model to test from model()")

    def conditions(self) -> Conditions:
        """Return the conditions to simulate under: 40 s at 10 Hz with a gap, in still water."""
        from driftwalk.model import Study

        time = np.arange(400) / 10.0
        return Conditions(
            sample_time=time[(time < 12.0) | (time > 15.0)],
            start=Start(0.02, -0.01, 0.3, 0.01, 0.02, 0.1),
            camera=Camera(position_noise=3e-4, orientation_noise=0.01),
            tank=Study().tank,
            view=None,
            flow=self.flow() if self.model().needs_flow else None,
            threads=2,
        )

    def flow(self) -> xr.Dataset:
        """Return the flow of the default conditions."""
        from driftwalk.flow import uniform_flow
        from driftwalk.model import Study

        return uniform_flow(0.0, 0.0, arena=Study().tank.to_arena())

    def test_the_parameters_have_names_of_their_own(self) -> None:
        """A model names one parameter or more, each once."""
        model = self.model()
        names = [parameter.name for parameter in model.parameters]
        assert isinstance(model, MotionModel), "a member of driftwalk.motion.MotionModel is missing"
        assert names
        assert len(set(names)) == len(names), names
        assert model.name

    def test_worlds_have_one_row_per_key_and_one_column_per_sample(self) -> None:
        """Shapes, and worlds that are sound within the ranges."""
        like = self.conditions()
        worlds = self._worlds()
        for name, values in zip(("x", "y", "theta"), worlds[:3], strict=True):
            assert values.shape == (WORLDS, like.sample_time.size), name
            assert values.dtype.kind == "f", name
        assert worlds.status.shape == (WORLDS,)
        assert (worlds.status & ~np.uint32(sum(STATUS.values())) == 0).all()
        sound = worlds.status == 0
        assert sound.any(), "no world in the middle of the ranges is sound"
        assert np.isfinite(worlds.x[sound]).all()
        assert np.isfinite(worlds.y[sound]).all()

    def test_the_same_address_gives_the_same_bits(self) -> None:
        """Two calls agree, and threads do not matter."""
        like = self.conditions()
        first = self._simulate(like, slice(None))
        again = self._simulate(replace(like, threads=1), slice(None))
        assert_same(first, again, "a second call gave other numbers")

    def test_another_address_gives_other_numbers(self) -> None:
        """Worlds of one setting differ from each other."""
        worlds = self._worlds()
        assert not np.array_equal(worlds.x[0], worlds.x[1]), "two keys gave the same world"

    def test_the_order_of_the_worlds_does_not_matter(self) -> None:
        """A permuted batch gives the permuted worlds."""
        like, order = self.conditions(), np.array([4, 0, 6, 2, 5, 1, 3])
        whole = self._simulate(like, slice(None))
        permuted = self._simulate(like, order)
        expected = Worlds(*(values[order] for values in whole))
        assert_same(permuted, expected, "the order of the batch is part of the result")

    def test_company_does_not_matter(self) -> None:
        """Every world is the same alone."""
        like = self.conditions()
        whole = self._simulate(like, slice(None))
        for world in range(WORLDS):
            alone = self._simulate(like, slice(world, world + 1))
            expected = Worlds(*(values[world : world + 1] for values in whole))
            assert_same(alone, expected, "the rest of the batch is part of the result")

    def test_the_ends_of_the_ranges_give_a_status_and_no_error(self) -> None:
        """Whatever a search may ask for comes back as worlds."""
        like = self.conditions()
        model = self.model()
        corners = np.array(
            np.meshgrid(*([one.low, one.high] for one in model.parameters), indexing="ij")
        ).reshape(len(model.parameters), -1)
        values = {one.name: corners[k] for k, one in enumerate(model.parameters)}
        keys = world_keys(3, trial=np.arange(corners.shape[1]), replicate=0)
        worlds = model.simulate(values, like, keys)
        assert worlds.status.shape == keys.shape
        sound = (worlds.status & STATUS["non_finite"]) == 0
        assert np.isfinite(worlds.x[sound]).all()

    def test_positions_have_the_resolution_of_the_file(self) -> None:
        """The camera of the recording is part of a world."""
        quantum = 1e-3
        like = replace(self.conditions(), camera=Camera(position_quantum=quantum))
        worlds = self._simulate(like, slice(None))
        steps = worlds.x[worlds.status == 0].astype(np.float64) / quantum
        assert np.abs(steps - np.round(steps)).max() < 1e-3, "positions are not rounded"

    def test_it_describes_itself_in_json(self) -> None:
        """The record of a run holds what determines the numbers."""
        model = self.model()
        json.dumps(model.describe())
        json.dumps(model.facts({one.name: one.high for one in model.parameters}))

    def test_its_own_score_is_that_of_its_worlds(self) -> None:
        """A fused path gives the bits of simulating, forming steps and comparing."""
        model, like = self.model(), self.conditions()
        if not isinstance(model, ScoresItself):
            return
        worlds = self._worlds()
        track = Track(like.sample_time, *(row[0].astype(np.float64) for row in worlds[:3]))
        reference = StepDistance().prepare(track)
        own = score_worlds(model, self._values(), like, self._keys(), reference, details="steps")
        table = step_table(reference.plan, worlds.x, worlds.y)
        np.testing.assert_array_equal(own["pairs"], table.pairs)
        for world, count in enumerate(table.pairs):
            np.testing.assert_array_equal(
                own["step_length"][world, :count], table.length[world, :count]
            )
        found = StepDistance().distances(reference, table)
        sound = worlds.status == 0
        np.testing.assert_array_equal(own["ks_distance"][sound], found.distance[sound])

    def _worlds(self) -> Worlds:
        return self._simulate(self.conditions(), slice(None))

    def _simulate(self, like: Conditions, chosen: slice | Keys | np.ndarray) -> Worlds:
        values = {name: column[chosen] for name, column in self._values().items()}
        return self.model().simulate(values, like, self._keys()[chosen])

    def _keys(self) -> Keys:
        # Three replicates of one setting, then four settings.
        return world_keys(1, trial=[0, 0, 0, 1, 2, 3, 4], replicate=[0, 1, 2, 0, 0, 0, 0])

    def _values(self) -> dict[str, Floats]:
        shares = np.array([0.5, 0.5, 0.5, 0.3, 0.4, 0.6, 0.7])
        values = {}
        for one in self.model().parameters:
            low, high = one.to_coordinate([one.low, one.high])
            values[one.name] = one.to_value(low + shares * (high - low))
        return values


def assert_same(found: Worlds, expected: Worlds, message: str) -> None:
    """Fail unless two sets of worlds are the same bit for bit.

    Parameters
    ----------
    found, expected : Worlds
        What is compared; a missing sample equals a missing sample.
    message : str
        What to say otherwise.

    Raises
    ------
    AssertionError
        When a value differs.
    """
    for name, one, other in zip(Worlds._fields, found, expected, strict=True):
        same = np.array_equal(one, other, equal_nan=one.dtype.kind == "f")
        assert same, f"{message}: {name} differs"
