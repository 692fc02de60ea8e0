"""The models of the package are held to the contract, and the contract can fail."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from walkers import diffuse, tumble

import driftwalk as dw
from driftwalk.motion import BlockModel, motion_model
from driftwalk.schema import Parameter
from driftwalk.simulation.backend import Camera
from driftwalk.testing import MotionModelContract

TUMBLE = {"speed": (0, 0.1, "m/s"), "tumble_rate": (0, 5, "1/s")}


class TestBlock(MotionModelContract):
    def model(self):
        return BlockModel(dw.Study())

    def flow(self):
        return dw.tank30_flow()


class TestTumble(MotionModelContract):
    def model(self):
        return motion_model(tumble, **TUMBLE)


class TestTumbleOfManySettings(MotionModelContract):
    def model(self):
        return motion_model(tumble, settings="many", **TUMBLE)


class TestDiffuse(MotionModelContract):
    def model(self):
        return motion_model(diffuse, Parameter("diffusivity", "m2/s", 1e-7, 1e-4, scale="log"))


def with_a_generator_of_its_own(scene, *, spread):
    random = np.random.default_rng()
    return tuple(spread * random.normal(size=(2, scene.worlds, scene.times.size)))


GLOBAL = np.random.default_rng(1)


def with_one_stream_for_all(scene, *, spread):
    return tuple(spread * GLOBAL.normal(size=(2, scene.worlds, scene.times.size)))


def with_a_stream_of_the_batch(scene, *, spread):
    random = scene.random.generators[0]
    return tuple(spread * random.normal(size=(2, scene.worlds, scene.times.size)))


def without_chance(scene, *, spread):
    still = np.broadcast_to(np.cos(scene.times), (scene.worlds, scene.times.size))
    return spread * still, spread * still


@pytest.mark.parametrize(
    ("function", "check", "message"),
    [
        (with_a_generator_of_its_own, "same_address_gives_the_same_bits", "a second call"),
        (with_one_stream_for_all, "same_address_gives_the_same_bits", "a second call"),
        (with_a_stream_of_the_batch, "order_of_the_worlds_does_not_matter", "the order"),
        (with_a_stream_of_the_batch, "company_does_not_matter", "the rest of the batch"),
    ],
)
def test_a_model_that_breaks_its_promise_fails(function, check, message):
    class Broken(MotionModelContract):
        def model(self):
            return motion_model(function, settings="many", spread=(0.01, 0.1, "m"))

    names = [name for name in dir(Broken) if check in name]
    with pytest.raises(AssertionError, match=message):
        getattr(Broken(), names[0])()


def test_a_model_without_chance_fails():
    class Still(MotionModelContract):
        def conditions(self):
            return replace(super().conditions(), camera=Camera())

        def model(self):
            return motion_model(without_chance, spread=(0.01, 0.1, "m"))

    with pytest.raises(AssertionError, match="two keys gave the same world"):
        Still().test_another_address_gives_other_numbers()
