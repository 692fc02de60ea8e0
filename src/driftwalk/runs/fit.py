"""The run of a likelihood fit, with its flow and the check of its model."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Self

from driftwalk.core.errors import InputError
from driftwalk.core.progress import ignore_progress
from driftwalk.runs.finished_run import run_folder
from driftwalk.runs.resumable_run import FLOW_ERRORS, dataset_hash

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.figures.write import Figures
    from driftwalk.likelihood import EarlierFit
    from driftwalk.model import Study
    from driftwalk.runs.resumable_run import Run


class Fitted(NamedTuple):
    """Results of a run."""

    fit: xr.Dataset
    check: xr.Dataset | None
    """Whether the model explains the recordings; None without a check."""


@dataclass(frozen=True)
class FitWork:
    """A likelihood fit.

    Attributes
    ----------
    recordings : sequence of xarray.Dataset
        The `trajectory` datasets.
    study : Study
        Block, tank and the section [fit].
    body : str or None
        The body.
    inputs : mapping of str to Path
        The files that were read, by their role.
    check : bool
        Whether the model is checked.
    compare_laws : bool
        Whether force laws are compared, which takes some eight fits.
    wall : bool
        Whether restitution and friction of the wall are estimated, which takes as long as a fit.
    flow : xarray.Dataset or None
        A measured `flow_field`.
    earlier : EarlierFit or None
        Of glued blocks, a fit of one block in the same water.
    fitted : callable
        Called with the fit as soon as it is stored, before all that follows.
    checked_model : callable
        Called with the whole fit and its check, or None without one, before the figures.
    """

    recordings: Sequence[xr.Dataset]
    study: Study
    body: str | None
    inputs: Mapping[str, Path]
    check: bool = True
    compare_laws: bool = False
    wall: bool = False
    flow: xr.Dataset | None = None
    earlier: EarlierFit | None = None
    fitted: Callable[[xr.Dataset], None] = ignore_progress
    checked_model: Callable[[xr.Dataset, xr.Dataset | None], None] = ignore_progress

    kind: ClassVar = "fit"
    seeds: ClassVar[Mapping[str, int]] = {}

    def checked(self) -> Self:
        """Refuse recordings that cannot be fitted."""
        from driftwalk.likelihood import check_fit

        check_fit(self.recordings, self.study, body=self.body, flow=self.flow)
        return self

    def specification(self) -> dict[str, Any]:
        """Return what determines the numbers of the fit."""
        return {
            "study": self.study.to_dict(),
            "body": self.body,
            "check": self.check,
            "compare_laws": self.compare_laws,
            "wall": self.wall,
            "recordings_sha256": [
                dataset_hash(one, ("x", "y", "theta")) for one in self.recordings
            ],
            **({} if self.flow is None else {"flow_sha256": _hash_of(self.flow)}),
            **({} if self.earlier is None else {"earlier_sha256": _hash_of(self.earlier.fit)}),
        }

    def compute(self, run: Run) -> Fitted:
        """Fit and check the model."""
        from driftwalk.likelihood import (
            compare_laws,
            estimate_wall,
            fit_motion,
            fitted_flow,
            judge_fit,
        )

        staged = run.staged_progress(self._usual_parts())
        staged.begin("fit")
        found = fit_motion(
            self.recordings,
            self.study,
            body=self.body,
            flow=self.flow,
            earlier=self.earlier,
            tell=staged.stage("fit"),
        )
        run.keep_result(found)
        run.keep("flow.nc", fitted_flow(found))
        for number, recording in enumerate(self.recordings, start=1):
            run.keep("recording.nc" if number == 1 else f"recording-{number}.nc", recording)
        self.fitted(found)
        check = None
        if self.compare_laws:
            found = compare_laws(found, self.recordings, body=self.body, tell=staged.stage("laws"))
        if self.wall:
            found = estimate_wall(found, self.recordings, body=self.body, tell=staged.stage("wall"))
        if self.check:
            staged.begin("check")
            found, check = judge_fit(found, self.recordings, body=self.body)
            if check is not None:
                check = run.keep("check.nc", check)
        # The fit was stored before, so that a kill does not lose it; now with all that was added.
        found = run.keep_result(found)
        self.checked_model(found, check)
        staged.begin("figures")
        run.draw()
        return Fitted(found, check)

    def _usual_parts(self) -> dict[str, float]:
        """Return how long each stage usually takes [s], measured on the bundled recording."""
        samples = sum(one.sizes["time"] for one in self.recordings)
        fit = 2.2 + 7.5e-4 * samples
        return {
            "fit": fit,
            **({"laws": 6.5 * fit} if self.compare_laws else {}),
            **({"wall": fit} if self.wall else {}),
            **({"check": 2.2 + 2.2e-4 * samples} if self.check else {}),
            "figures": 6.7 if self.check else 3.8,
        }


def read_earlier_fit(source: Path | xr.Dataset) -> EarlierFit:
    """Return a finished fit with its recordings, as the start of a fit of glued blocks.

    Parameters
    ----------
    source : Path or xarray.Dataset
        The run directory of a fit, or a `fit` that was read from one.

    Raises
    ------
    InputError
        When there is no directory, or it holds no fit with its recordings.

    Examples
    --------
    >>> len(read_earlier_fit(Path("fit")).recordings)  # doctest: +SKIP
    1
    """
    from driftwalk.likelihood import EarlierFit
    from driftwalk.schema.runs import open_run_folder, run_kind

    folder = source if isinstance(source, Path) else run_folder(source)
    if folder is None:
        raise InputError(
            "a fit in memory does not hold its recordings: give the run directory that it was made "
            "in, or EarlierFit(fit, recordings)"
        )
    run = open_run_folder(folder)
    file = run_kind("fit").file
    found, recordings = run.dataset(file), run.recordings()
    if found is None or not recordings:
        raise InputError(
            f"{folder} is no finished fit with its recording ({file}, recording.nc): make one with "
            f"driftwalk fit RECORDING -o {folder}"
        )
    return EarlierFit(found, recordings)


def _hash_of(flow: xr.Dataset) -> str | None:
    """Return the hash of what a fit takes from a measured flow."""
    return dataset_hash(flow, ("u", "v", "flag"), where_held=FLOW_ERRORS)


def figures_of_fit(
    fit: xr.Dataset,
    recording: xr.Dataset,
    body: str | None = None,
    check: xr.Dataset | None = None,
) -> Figures:
    """Return the figures of a fit that a run holds."""
    from driftwalk.figures import fit_figures
    from driftwalk.likelihood import fitted_flow

    first = [0]
    if "flow" in fit.dims:
        interval_flow = fit["interval_flow"].values.tolist()
        first = [interval_flow.index(flow) for flow in range(fit.sizes["flow"])]
    flows = [fitted_flow(fit, interval=interval) for interval in first]
    return fit_figures(fit, recording, flows=flows, body=body, check=check)
