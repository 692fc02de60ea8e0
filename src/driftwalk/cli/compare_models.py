"""`driftwalk compare-models`: which motion model explains a recording."""

from __future__ import annotations

from collections.abc import Sequence

from driftwalk.cli.inputs.recordings import read_for_models
from driftwalk.cli.options.model import parameter_choices
from driftwalk.cli.options.recording import RecordingFile, RecordingOptions, with_recording_options
from driftwalk.cli.options.run import RunOptions, with_run_options
from driftwalk.cli.options.shared_types import FlowFile, optional
from driftwalk.cli.options.study import StudyOptions, with_study_options
from driftwalk.cli.terminal.output import print_result, printable
from driftwalk.cli.terminal.progress import ProgressReporter
from driftwalk.core.errors import ConfigurationError
from driftwalk.core.study_keys import CALIBRATION_KEYS


@with_run_options
@with_recording_options
@with_study_options(
    CALIBRATION_KEYS,
    *("body_shape", "side", "mass", "depth", "force_interval"),
    *("wall_friction", "wall_restitution", "time_step", "step_interval"),
    *("position_noise", "orientation_noise", "bootstrap", "seed"),
    "flow_repeat",
)
def compare_models(
    recording: RecordingFile,
    given: StudyOptions,
    how: RecordingOptions,
    models: str | None = optional(
        "--models NAMES",
        "Models, separated by commas, such as block,run_tumble+wall; or all. Default: the "
        "block and the family with an interaction with the wall.",
    ),
    parameters: list[str] | None = optional(
        "--parameter NAME=VALUE|LOW,HIGH",
        "Known value, or range of the search, of a parameter of each of the --models that has "
        "it; repeat for others.",
    ),
    clearance: float | None = optional(
        "--clearance",
        "Distance of the recorded point from the wall at contact: half the body's width. "
        "Default: estimated from the recording.",
        unit="m",
    ),
    flow: FlowFile = None,
    *,
    options: RunOptions,
) -> None:
    """Say which motion models explain a recording.

    Fits every model to one half of the recording's blocks of time, and judges all of them on the
    other half, together with two baselines that only resample recorded steps. Summaries of the
    motion decide between the closest models. Reports the ranking, and where a model differs from
    the recording. If you stop the run, the same command continues it.
    """
    from driftwalk.calibration import ALL_MODELS, DEFAULT_MODELS
    from driftwalk.motion import models_knowing
    from driftwalk.runs import ModelComparisonWork, run_work

    if models is None:
        named: Sequence[str] = DEFAULT_MODELS
    elif models.strip() == "all":
        named = ALL_MODELS
    else:
        named = [name for name in map(str.strip, models.split(",")) if name]
    known = parameter_choices(parameters)
    if isinstance(clearance, tuple):
        raise ConfigurationError("--clearance is a length without a standard deviation")
    if clearance is not None:
        known["clearance"] = clearance
    chosen = models_knowing(named, known)
    read, begun = read_for_models(recording, flow, given, how, chosen)
    with options.reported("compare models") as told:
        # A reader sees the ranking grow, model by model; a program takes the whole result.
        if not options.json:
            read["finished"] = Ranking(told["progress"])
        work = ModelComparisonWork(**read, models=chosen, threads=options.threads)
        found = run_work(work, options.out, overwrite=options.overwrite, begun=begun, **told)
    print_result(found, options.out, json=options.json)


class Ranking:
    """Prints each model as soon as it is judged, its place so far, and how long the rest takes.

    Parameters
    ----------
    progress : ProgressReporter
        Knows the time left.
    """

    def __init__(self, progress: ProgressReporter) -> None:
        self._progress = progress
        self._scores: list[float] = []

    def __call__(self, name: str, score: float, std: float, models: int) -> None:
        """Print a model."""
        place = 1 + sum(one < score for one in self._scores)
        self._scores.append(score)
        count = len(self._scores)
        words = f"{name}: distance {score:.2f} ± {std:.2f}, place {place} of {count} so far"
        rest = f"; {models - count} to go" if models > count else ""
        left = f"; {self._progress.left}" if self._progress.left else ""
        print(printable(f"{words}{rest}{left}"), flush=True)
