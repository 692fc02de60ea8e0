"""A ninth kind of run, all in this file: the share of random points in a quarter of a circle."""

from __future__ import annotations

import os
import signal
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import matplotlib.figure
import numpy as np
import xarray as xr

from driftwalk.core.errors import InputError
from driftwalk.model import Study
from driftwalk.page.parts import Section, section
from driftwalk.runs import Run
from driftwalk.schema.answers.parts import Answer, Row, lines_of
from driftwalk.schema.runs import RunKind, register
from driftwalk.sweep import WorkUnit, grid, run_sweep
from driftwalk.viewer.watch.run_page import NO_CELL
from driftwalk.viewer.watch.shards import RunReader


@dataclass(frozen=True)
class ToyWork:
    """How many sets of points, and the set during which the process is killed."""

    sets: int
    killed_at: int = -1
    study: Study = field(default_factory=Study)

    kind: ClassVar = "toy"
    inputs: ClassVar[Mapping[str, Path]] = {}
    seeds: ClassVar = {"toy": 1}

    def checked(self) -> ToyWork:
        if self.sets < 1:
            raise InputError("a toy needs a set of points")
        return self

    def specification(self) -> dict[str, Any]:
        return {"sets": self.sets}

    def compute(self, run: Run) -> xr.Dataset:
        units = grid(set=np.arange(self.sets)).units(1)
        store = run.store("sets")
        found = run_sweep(self._share, units, store=store, executor=run.executor)
        attrs = {"kind": "toy", "schema_version": 1}
        return run.keep("toy.nc", xr.Dataset({"share": ("set", found["share"])}, attrs=attrs))

    def _share(self, unit: WorkUnit) -> dict[str, np.ndarray]:
        if unit.start == self.killed_at:
            os.kill(os.getpid(), signal.SIGKILL)
        points = np.random.default_rng([1, unit.start]).random((1000, 2))
        return {"share": np.array([(np.hypot(*points.T) < 1.0).mean()])}


def toy_answer(found: xr.Dataset) -> Answer:
    value = f"{4.0 * float(found['share'].mean()):.3f}"
    return Answer([Row("π", value)], {"pi": float(value)}, [])


def toy_sections(toy: xr.Dataset | None) -> list[Section]:
    lines = ["Nothing is there yet."] if toy is None else lines_of(toy_answer(toy).parts)
    return [section("summary", "summary", "Toy", paragraphs=lines, numbers=[])]


def toy_figures(toy: xr.Dataset) -> dict[str, Any]:
    def shares() -> matplotlib.figure.Figure:
        figure = matplotlib.figure.Figure()
        figure.add_subplot().plot(toy["share"].values)
        return figure

    return {"shares": shares}


class RunningToy:
    """A toy under way."""

    title = "A toy under way"

    def __init__(self, folder: Path, specification: Mapping[str, Any]) -> None:
        self._reader, self._done = RunReader(folder), 0
        self._sets = int(specification["sets"])

    def look(self) -> list[Section]:
        self._done += sum(1 for _ in self._reader.new_units())
        return self.sections()

    def sections(self) -> list[Section]:
        words = f"{self._done} of {self._sets} sets"
        return [section("sets", "summary", "Sets", paragraphs=[words], numbers=[])]

    def state(self) -> tuple[float | None, str]:
        return self._done / self._sets, "sets"

    def cell(self, row: int, column: int) -> dict[str, Any]:
        return dict(NO_CELL)


TOY = register(
    RunKind(
        name="toy",
        title="Toy",
        under_way="A toy under way",
        words="toy",
        command="toy",
        file="toy.nc",
        figures=toy_figures,
        page=toy_sections,
        live=RunningToy,
        answer=toy_answer,
    )
)
