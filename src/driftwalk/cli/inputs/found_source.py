"""Where simulate and play take their model from, where a run is given."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from driftwalk.cli.inputs.assembly_source import load_flow_for, refuse_found
from driftwalk.cli.options.study import StudyOptions
from driftwalk.core.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study
    from driftwalk.motion import MotionModel
    from driftwalk.runs import FoundRun


@dataclass(frozen=True)
class FoundSource:
    """A run, with the options of the command over its study.

    Attributes
    ----------
    folder : Path
        The run directory.
    found : FoundRun
        What it has found.
    given : StudyOptions
        The options.
    """

    folder: Path
    found: FoundRun
    given: StudyOptions

    @property
    def is_block(self) -> bool:
        """Whether the run is about the block in stirred water."""
        from driftwalk.motion import BlockModel

        return self.found.model == BlockModel.name

    def study(self) -> Study:
        """Return the study of the run, with the options over it."""
        if self.is_block:
            own = self.found.block_study()
        elif self.given.file is not None or not self.found.has_study:
            return self.given.study()
        else:
            own = self.found.study()
        return self.given.over(own, base=f"the study of {self.folder}")

    def block(self, flow: Path | None) -> tuple[Study, xr.Dataset]:
        """Return study and flow of the block; a given flow field goes over that of the run."""
        chosen = self.study()
        if flow is not None:
            return chosen, load_flow_for(flow, chosen)
        return chosen, self.found.flow(self.found.block_study())

    def flow_for(self, model: MotionModel, study: Study, flow: Path | None) -> xr.Dataset | None:
        """Return the flow for a motion model, None where it has no use for any."""
        if flow is not None:
            return load_flow_for(flow, study)
        return self.found.flow(study) if model.needs_flow else None


def open_run(folder: Path, given: StudyOptions, model: str | None) -> FoundSource:
    """Return a run that the user has named as the model.

    Raises
    ------
    InputError
        When it cannot be used, or an option contradicts it.
    """
    from driftwalk.runs import read_found

    source = FoundSource(folder, read_found(folder), given)
    # The values of another model hold in any study; those of the block belong to its own.
    own = source.is_block and given.file is not None
    refuse_found(folder, given.overrides, also=["--study"] if own else [])
    # A comparison of models holds values for the block and for others.
    one = "model" not in source.found.found.dims
    if model is not None and one and source.is_block:
        raise InputError(f"{folder} is about the block, and not about {model}: leave out --model")
    return source
