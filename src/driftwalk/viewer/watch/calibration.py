"""A calibration under way: the map that fills, the refined map in it, the bootstrap."""

from __future__ import annotations

import contextlib
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.calibration_stages import (
    CALIBRATION_STAGES,
    MORE,
    share_of_map,
    share_of_windows,
)
from driftwalk.core.errors import DriftwalkError
from driftwalk.core.files.run_layout import run_file
from driftwalk.flow import load_flow
from driftwalk.model import Study
from driftwalk.page import encode_array
from driftwalk.page.parts import Section
from driftwalk.page.sections.calibration import bootstrap_section, one_body, profile_sections
from driftwalk.page.sections.flow import flow_section
from driftwalk.page.sections.map import map_section
from driftwalk.page.sections.recording import trajectory_section
from driftwalk.record import load
from driftwalk.schema import Parameter
from driftwalk.schema.parameters import BLOCK
from driftwalk.viewer.watch.recording_steps import RecordedSteps, recorded_steps
from driftwalk.viewer.watch.run_page import NO_CELL, Running
from driftwalk.viewer.watch.shards import FinishedUnit

if TYPE_CHECKING:
    import xarray as xr


DETAILS: Final = ("excerpt_x", "excerpt_y", "step_density", "ks_step_length", "ks_turning_angle")


class SettingsMap:
    """Distances over a grid of settings, NaN where they are still to come.

    Parameters
    ----------
    axes : sequence of sequence of float
        Coordinates of the grid, one list per parameter.
    """

    def __init__(self, axes: Any) -> None:
        self.axes = tuple(np.asarray(values, dtype=np.float64) for values in axes)
        self.shape = tuple(axis.size for axis in self.axes)
        self.distance = np.full(self.shape, np.nan)
        self.error = np.full(self.shape, np.nan)
        self.details: dict[int, dict[str, npt.NDArray[Any]]] = {}
        """Results kept for each setting, by its number."""

    @property
    def done(self) -> float:
        """Share of the settings that are there."""
        return float(np.isfinite(self.distance).mean())

    def add(self, unit: FinishedUnit) -> None:
        """Take the settings of a work unit."""
        # A setting that lost its numbers is as far as can be, as in the finished map.
        values = np.nan_to_num(unit.arrays["ks_distance"], nan=1.0)
        count = values.shape[1]
        settings = slice(unit.start, unit.stop)
        self.distance.reshape(-1)[settings] = values.mean(axis=1)
        if count > 1:
            self.error.reshape(-1)[settings] = values.std(axis=1, ddof=1) / np.sqrt(count)
        kept: dict[str, npt.NDArray[Any]] = {
            name: unit.arrays[name] for name in DETAILS if name in unit.arrays
        }
        kept["away"] = np.abs(unit.arrays["ks_distance"] - values.mean(axis=1)[:, None])
        for row in range(unit.stop - unit.start):
            self.details[unit.start + row] = {name: kept[name][row] for name in kept}


class RunningCalibration(Running):
    """A calibration under way.

    Parameters
    ----------
    folder : Path
        The run directory.
    specification : mapping
        Everything that determines its numbers.
    """

    def __init__(self, folder: Path, specification: Mapping[str, Any]) -> None:
        super().__init__(folder, specification)
        self._folder = folder
        self._study = Study(**specification["study"])
        self._body: str | None = specification.get("body")
        self._parameters = _parameters(specification, self._study)
        self._maps: dict[str, SettingsMap] = {}
        self._more: dict[str, int] = {}
        """How many settings of a map are simulated more often, by the stage of the map."""
        self._more_done: Counter[str] = Counter()
        self._bootstrap: list[FinishedUnit] = []
        self._loaded: xr.Dataset | None = None
        self._steps: RecordedSteps | None = None
        self._still: dict[str, Section] = {}
        self._stage = "coarse"
        self._refined = ""

    def look(self) -> list[Section]:
        """Read the new shards, and return the sections that they changed."""
        self._reader.look()
        changed = set()
        for name, reader in self._reader.sweeps.items():
            of_map = name.removeprefix(MORE)
            stage = of_map.partition("-")[0]
            if stage not in CALIBRATION_STAGES:
                continue
            self._stage = stage
            if of_map != name and stage not in self._more:
                self._more[stage] = len(reader.sweep["chosen"])
            elif of_map == name and stage != "bootstrap" and name not in self._maps:
                self._maps[name] = SettingsMap(reader.sweep["axes"])
                changed.add("map")
            if stage == "refined":
                self._refined = of_map
            for unit in reader.new_units():
                changed |= self._changed_by(name, stage, unit)
        made = {"map": self._map_section, "bootstrap": self._bootstrap_section}
        return [made[name]() for name in sorted(changed, reverse=True)]

    def sections(self) -> list[Section]:
        """Return the map, the bootstrap when it has begun, and what it is all made from."""
        bootstrap = [self._bootstrap_section()] if self._bootstrap else []
        return [self._map_section(), *bootstrap, *self._made_from]

    def state(self) -> tuple[float | None, str]:
        """Return the progress and the stage."""
        stage = CALIBRATION_STAGES[self._stage]
        share = self._share()
        how_far = f"{100.0 * share:.0f} %" if share < 1.0 else "done, the next step is under way"
        return stage.percent(share) / 100.0, f"{stage.words}: {how_far}"

    def cell(self, row: int, column: int) -> dict[str, Any]:
        """Return the kept excerpt and step density of a setting; the first parameter is along x."""
        found = self._coarse
        kept = None
        if found is not None and len(found.shape) == 2:
            columns, rows = found.shape
            if 0 <= column < columns and 0 <= row < rows:
                kept = found.details.get(column * rows + row)
        if not kept or "excerpt_x" not in kept:
            return dict(NO_CELL)
        time = None if self._recorded is None else self._recorded.excerpt_time
        nearest = int(np.nanargmin(kept["away"])) if np.isfinite(kept["away"]).any() else 0
        return {
            "excerpt_time": None
            if time is None or time.size != kept["excerpt_x"].size
            else encode_array(time),
            "excerpt_x": encode_array(kept["excerpt_x"]),
            "excerpt_y": encode_array(kept["excerpt_y"]),
            "density": encode_array(kept["step_density"]),
            # Of the replicate nearest to the mean, as in the finished map.
            "ks_step_length": float(kept["ks_step_length"][nearest]),
            "ks_turning_angle": float(kept["ks_turning_angle"][nearest]),
        }

    def _changed_by(self, name: str, stage: str, unit: FinishedUnit) -> set[str]:
        """Take a work unit, and return the sections that it changes."""
        if name.startswith(MORE):
            self._more_done[stage] += unit.stop - unit.start
            return set()
        if stage == "bootstrap":
            self._bootstrap.append(unit)
            return {"bootstrap"}
        self._maps[name].add(unit)
        return {"map"}

    def _share(self) -> float:
        if self._stage == "bootstrap":
            done = sum(unit.stop - unit.start for unit in self._bootstrap)
            return done / max(self._study.calibration.bootstrap, 1)
        more = self._more_done[self._stage] / max(self._more.get(self._stage, 0), 1)
        if self._stage == "coarse":
            return 0.0 if self._coarse is None else share_of_map([self._coarse.done, more])
        refined = [one.done for name, one in self._maps.items() if name.startswith("refined-")]
        return share_of_windows([*refined, more])

    @property
    def _coarse(self) -> SettingsMap | None:
        names = [name for name in self._maps if name.startswith("coarse-")]
        return self._maps[names[0]] if names else None

    @property
    def _recording(self) -> xr.Dataset | None:
        """The recording; None where the run holds none that can be read, or not yet."""
        if self._loaded is None:
            with contextlib.suppress(DriftwalkError, OSError):
                path = run_file(self._folder, "recording.nc")
                self._loaded = None if path is None else load(path)
        return self._loaded

    @property
    def _recorded(self) -> RecordedSteps | None:
        """The steps of the recording, once it is there."""
        if self._steps is None and self._recording is not None:
            with contextlib.suppress(DriftwalkError):
                self._steps = recorded_steps(self._recording, self._study, body=self._body)
        return self._steps

    @property
    def _made_from(self) -> list[Section]:
        """The sections on the recording and on the flow, once they are there."""
        if "recording" not in self._still and self._recording is not None:
            self._still["recording"] = trajectory_section(self._recording, body=self._body)
        if "flow" not in self._still:
            with contextlib.suppress(DriftwalkError, OSError):
                path = run_file(self._folder, "flow.nc")
                if path is not None:
                    self._still["flow"] = flow_section(load_flow(path, own_flags="keep"))
        return list(self._still.values())

    def _map_section(self) -> Section:
        found = self._dataset()
        if len(self._parameters) == 1:
            section = {**profile_sections(found)[0], "id": "map"}
        else:
            section = map_section(found, one_body(self._recording, self._body))
        waiting = "Settings appear as they are simulated; nothing is final before the run is."
        return {**section, "note": f"{section['note']} {waiting}"}

    def _dataset(self) -> xr.Dataset:
        """Return what is there of the calibration that is being made, in its own form."""
        import xarray as xr

        names = tuple(one.name for one in self._parameters)
        waiting = [one.coordinates for one in self._parameters]
        coarse = self._coarse or SettingsMap(waiting)
        variables: dict[str, Any] = {
            "ks_distance": (names, coarse.distance),
            "ks_distance_standard_error": (names, coarse.error),
        }
        coordinates = self._axes(coarse, "")
        refined = self._maps.get(self._refined)
        if refined is not None:
            dims = [f"refined_{name}" for name in names]
            variables["refined_ks_distance"] = (dims, refined.distance)
            coordinates |= self._axes(refined, "refined_")
        if self._recorded is not None:
            bins = ("density_step_length", "density_turning_angle")
            variables["recording_step_density"] = (bins, self._recorded.density())
            variables["excerpt_time"] = ("excerpt_sample", self._recorded.excerpt_time)
            coordinates["step_length_edge"] = self._recorded.length_edge
            coordinates["turning_angle_edge"] = self._recorded.angle_edge
        if names == BLOCK:
            variables["force_interval"] = ((), self._study.forces.force_interval_s)
        return xr.Dataset(variables, coordinates, {"kind": "calibration"})

    def _axes(self, found: SettingsMap, prefix: str) -> dict[str, Any]:
        """Return the coordinates of a map in the units of the parameters."""
        return {
            f"{prefix}{one.name}": (
                f"{prefix}{one.name}",
                one.to_value(axis),
                {"units": one.unit, "long_name": one.label, "scale": one.scale},
            )
            for one, axis in zip(self._parameters, found.axes, strict=True)
        }

    def _bootstrap_section(self) -> Section:
        units = sorted(self._bootstrap, key=lambda unit: unit.start)
        found = self._dataset()
        for one in self._parameters:
            values = np.concatenate([unit.arrays[one.name] for unit in units] or [np.empty(0)])
            found[f"bootstrap_{one.name}"] = ("bootstrap", one.to_value(values))
        return {
            **bootstrap_section(found),
            "id": "bootstrap",
            "title": "Bootstrap",
            "note": "Estimates from recordings that were simulated at the optimum: how far they "
            "scatter is how well the parameters are known.",
            "after": "map",
        }


def _parameters(specification: Mapping[str, Any], study: Study) -> tuple[Parameter, ...]:
    """Return what a run searches: the parameters of its model, without one those of the block."""
    model = specification.get("model")
    if model is not None:
        return tuple(Parameter(**described) for described in model["parameters"])
    search = study.calibration
    drag, force = BLOCK
    return (
        Parameter(
            drag, "1", search.drag_coefficient_min, search.drag_coefficient_max,
            search.drag_coefficient_step,
        ),
        Parameter(
            force, "N", search.force_std_min_N, search.force_std_max_N, search.force_std_step_N
        ),
    )  # fmt: skip
