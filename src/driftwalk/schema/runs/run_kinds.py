"""The registry of the kinds of runs, and which kind a dataset or a run directory is."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, Literal

from driftwalk.core.errors import InputError
from driftwalk.schema.answers import citation as cite
from driftwalk.schema.answers.parts import Answer, Following
from driftwalk.schema.check import kind_name

if TYPE_CHECKING:
    import xarray as xr

Maker = str | Callable[..., Any]
"""A callable, or where it stands, "module:name": its module is imported when it is used."""


@dataclass(frozen=True)
class RunKind:
    """A kind of run, declared once for every command, page and file that deals with its runs.

    The makers of figures and sections name, as their parameters, the datasets of the run that they
    use: ``check`` for ``check.nc``, ``recordings`` for all recordings, ``body`` for the name of the
    body. A dataset that is not there is None.

    Attributes
    ----------
    name : str
        Attribute ``kind`` of its result, and the key ``kind`` of its specification.
    title : str
        Title of its page.
    words : str
        Name of its result in a sentence.
    page : callable or str
        Returns the sections of its page.
    under_way : str
        Title of its live page before the run has finished; default: "A calibration under way" of
        "calibration".
    command : str
        The command that makes such a run; default: the name.
    file : str
        The file of its result; a finished run without a specification is known by it. Default: the
        name with ``.nc``.
    datasets : tuple of str
        The other datasets that it may hold, without the ending of their files.
    figures : callable or str, optional
        Returns its figures, a table from their names to functions that draw them.
    live : callable or str, optional
        View of a run under way, see `driftwalk.viewer.watch.run_page.Running`; without one the
        page counts the finished work units.
    answer : callable or str, optional
        Returns the `driftwalk.schema.answers.parts.Answer` of its result.
    places : mapping
        Files and folders of a run that its command names, by their labels.
    flow : callable or str, optional
        Returns the flow field that its result holds.
    following : Following, callable or str, optional
        What comes after it; a callable returns that of its result.
    methods : tuple of driftwalk.schema.answers.citation.Method
        What of others it uses, to be cited.
    gives_model : bool
        Whether later commands take a motion model with its values from it.
    drawn_from : {"", "covariance", "region"}
        What of its result parameters are drawn from, where it holds that.
    no_draws : str
        What is missing where no parameters can be drawn from its result.
    """

    name: str
    title: str
    words: str
    page: Maker
    under_way: str = ""
    command: str = ""
    file: str = ""
    datasets: tuple[str, ...] = ()
    figures: Maker | None = None
    live: Maker | None = None
    answer: Maker | None = None
    places: Mapping[str, str] = field(default_factory=dict)
    flow: Maker | None = None
    following: Following | Maker | None = None
    methods: tuple[cite.Method, ...] = ()
    gives_model: bool = False
    drawn_from: Literal["", "covariance", "region"] = ""
    no_draws: str = "no uncertainty of its values, as a fit or a calibration has"

    def __post_init__(self) -> None:
        object.__setattr__(self, "under_way", self.under_way or f"A {self.words} under way")
        object.__setattr__(self, "command", self.command or self.name)
        object.__setattr__(self, "file", self.file or f"{self.name}.nc")


def load_maker(maker: Maker) -> Callable[..., Any]:
    """Return a maker; one that is given by name is imported.

    Parameters
    ----------
    maker : callable or str
        The callable, or "module:name".

    Examples
    --------
    >>> load_maker("math:floor")(1.5)
    1
    """
    if not isinstance(maker, str):
        return maker
    module, _, name = maker.partition(":")
    found: Callable[..., Any] = getattr(import_module(module), name)
    return found


_ANSWERS: Final = "driftwalk.schema.answers"
_SECTIONS: Final = "driftwalk.page.sections"
_WATCH: Final = "driftwalk.viewer.watch"

BUILT_IN: Final = (
    RunKind(
        name="calibration",
        title="Calibration",
        words="calibration",
        command="calibrate",
        datasets=("flow", "recording"),
        figures="driftwalk.figures.calibration:calibration_figures",
        page=f"{_SECTIONS}.calibration:calibration_sections",
        live=f"{_WATCH}.calibration:RunningCalibration",
        gives_model=True,
        drawn_from="region",
        no_draws="no joint region to draw parameters from (`calibration.bootstrap` of 0)",
        answer=f"{_ANSWERS}.calibration:calibration_answer",
        places={"figures": "figures"},
        following=f"{_ANSWERS}.calibration:after_calibration",
        methods=(cite.KS_DISTANCE, cite.RANDOM_NUMBERS),
    ),
    RunKind(
        name="fit",
        title="Likelihood fit",
        words="fit",
        datasets=("flow", "recording", "check"),
        figures="driftwalk.runs.fit:figures_of_fit",
        page=f"{_SECTIONS}.fit:fit_sections",
        flow="driftwalk.likelihood:fitted_flow",
        gives_model=True,
        drawn_from="covariance",
        no_draws="no covariance to draw parameters from",
        answer=f"{_ANSWERS}.fit:fit_answer",
        places={"flow": "flow.nc"},
        following=f"{_ANSWERS}.fit:after_fit",
        methods=(
            cite.RESTRICTED_LIKELIHOOD,
            cite.PARTICLE_FILTER,
            cite.RANDOM_NUMBERS._replace(dataset="check"),
        ),
    ),
    RunKind(
        name="assembly",
        title="Self-assembly",
        under_way="Self-assembly under way",
        words="self-assembly",
        command="assemble",
        datasets=(
            "distribution",
            "class_times",
            "path",
            "attraction",
            "sizes",
            "steady_state",
            "assembly_drawn",
            "distribution_drawn",
            "sizes_drawn",
        ),
        figures="driftwalk.figures.assembly:assembly_figures",
        page=f"{_SECTIONS}.assembly:assembly_sections",
        live=f"{_WATCH}.assembly:RunningAssembly",
        answer="driftwalk.assembly.outcomes.run_answer:assembly_run_answer",
        following=Following(
            advice="Learn how fast, and by which steps: `driftwalk kinetics {run} -o kinetics`"
        ),
        methods=(cite.EXACT_INTERVALS, cite.SURVIVAL_CURVES, cite.RANDOM_NUMBERS),
    ),
    RunKind(
        name="sensitivity",
        title="Sensitivity of self-assembly",
        words="sensitivity analysis",
        datasets=("reference", "components", "sobol"),
        figures="driftwalk.figures.assembly:sensitivity_figures",
        page=f"{_SECTIONS}.sensitivity:sensitivity_sections",
        live=f"{_WATCH}.assembly:RunningSensitivity",
        answer=f"{_ANSWERS}.sensitivity:sensitivity_answer",
        methods=(cite.SOBOL_INDICES, cite.RANDOM_NUMBERS),
    ),
    RunKind(
        name="kinetics",
        title="Kinetics of self-assembly",
        under_way="Kinetics under way",
        words="kinetics",
        figures="driftwalk.figures.assembly:kinetics_figures",
        page=f"{_SECTIONS}.kinetics:kinetics_sections",
        answer=f"{_ANSWERS}.kinetics:kinetics_answer",
        places={"figures": "figures"},
        methods=(cite.HIDDEN_STATES, cite.SEVERAL_TESTS),
    ),
    RunKind(
        name="outcome_posterior",
        title="Parameters from outcomes alone",
        under_way="Parameters from outcomes under way",
        words="posterior from outcomes",
        command="infer-outcomes",
        file="posterior.nc",
        figures="driftwalk.figures.assembly:outcome_posterior_figures",
        page=f"{_SECTIONS}.outcome_posterior:outcome_posterior_sections",
        answer=f"{_ANSWERS}.outcome_posterior:outcome_posterior_answer",
        places={"figures": "figures"},
        methods=(
            cite.DIRICHLET_EMULATOR,
            cite.SYNTHETIC_LIKELIHOOD,
            cite.NODES_OF_EMULATOR,
            cite.SELF_CHECK,
            cite.LOGARITHMIC_SCORE,
            cite.RANDOM_NUMBERS,
        ),
    ),
    RunKind(
        name="yield",
        title="Yield of self-assembly",
        under_way="Search for the largest yield under way",
        words="yield",
        file="yields.nc",
        figures="driftwalk.figures.assembly:yield_figures",
        page=f"{_SECTIONS}.yields:yield_sections",
        live=f"{_WATCH}.assembly:RunningYield",
        answer=f"{_ANSWERS}.yields:yield_answer",
        places={"figures": "figures"},
        following=f"{_ANSWERS}.yields:after_yield",
        methods=(
            cite.SUCCESSIVE_HALVING,
            cite.COMPASS_SEARCH,
            cite.CONFIDENCE_SEQUENCE,
            cite.INDIFFERENCE_ZONE,
            cite.EXACT_INTERVALS,
            cite.RANDOM_NUMBERS,
        ),
    ),
    RunKind(
        name="control_policy",
        title="Control of self-assembly",
        under_way="A plan of control under way",
        words="control policy",
        command="control plan",
        file="policy.nc",
        figures="driftwalk.figures.assembly:policy_figures",
        page=f"{_SECTIONS}.control:policy_sections",
        answer=f"{_ANSWERS}.control:policy_answer",
        places={"figures": "figures"},
        following=Following(
            ("control test", "test"),
            "Test it in fresh worlds: `driftwalk control test {run} -o test`",
        ),
        methods=(
            cite.DECISION_PROCESS,
            cite.DRAWN_POLICIES,
            cite.ROLLOUTS,
            cite.PROBABILITY_MATCHING,
            cite.EXACT_INTERVALS,
            cite.RANDOM_NUMBERS,
        ),
    ),
    RunKind(
        name="control_test",
        title="Test of control",
        words="test of control",
        command="control test",
        datasets=("path",),
        figures="driftwalk.figures.assembly:trial_figures",
        page=f"{_SECTIONS}.control:trial_sections",
        answer=f"{_ANSWERS}.control:trial_answer",
        places={"figures": "figures"},
        following=f"{_ANSWERS}.control:after_test",
        methods=(cite.EXACT_INTERVALS, cite.INTERVAL_OF_DIFFERENCE, cite.RANDOM_NUMBERS),
    ),
    RunKind(
        name="recovery",
        title="Recovery study",
        words="recovery study",
        command="study recover",
        figures="driftwalk.figures.recovery:recovery_figures",
        page=f"{_SECTIONS}.recovery:recovery_sections",
        answer=f"{_ANSWERS}.recovery:recovery_answer",
        places={"every recording": "recovery.nc"},
        methods=(cite.RANDOM_NUMBERS,),
    ),
    RunKind(
        name="model_comparison",
        title="Comparison of motion models",
        under_way="A comparison of motion models under way",
        words="comparison of models",
        command="compare-models",
        file="comparison.nc",
        datasets=("recording", "flow"),
        figures="driftwalk.figures.motion_models:comparison_figures",
        page=f"{_SECTIONS}.motion_models:model_sections",
        gives_model=True,
        answer=f"{_ANSWERS}.model_comparison:comparison_answer",
        places={"comparison": "comparison.nc", "figures": "figures"},
        methods=(cite.KS_DISTANCE, cite.EVOLUTION_STRATEGY),
    ),
    RunKind(
        name="model_calibration",
        title="Calibration of a motion model",
        words="calibration",
        command="calibrate",
        datasets=("recording", "flow"),
        figures="driftwalk.figures.motion_models:model_calibration_figures",
        page=f"{_SECTIONS}.motion_models:model_calibration_sections",
        gives_model=True,
        answer=f"{_ANSWERS}.calibration:model_calibration_answer",
        places={"figures": "figures"},
        following=f"{_ANSWERS}.calibration:simulate_model",
        methods=(cite.SYNTHETIC_LIKELIHOOD, cite.ENSEMBLE_SAMPLER, cite.SIMULATED_COVARIANCE),
    ),
    RunKind(
        name="model_recovery",
        title="Recovery study of a motion model",
        words="recovery study",
        command="study recover",
        figures="driftwalk.figures.recovery:model_recovery_figures",
        page=f"{_SECTIONS}.recovery:model_recovery_sections",
        answer=f"{_ANSWERS}.recovery:model_recovery_answer",
        places={"every recording": "model_recovery.nc"},
    ),
)


_KINDS: Final[dict[str, RunKind]] = {kind.name: kind for kind in BUILT_IN}
RUN_KINDS: Final[Mapping[str, RunKind]] = MappingProxyType(_KINDS)
"""Every kind of run by its name."""


def register(kind: RunKind) -> RunKind:
    """Add a kind of run; every command and page knows it from then on.

    Parameters
    ----------
    kind : RunKind
        The kind.

    Raises
    ------
    InputError
        When another kind has its name or its file.
    """
    for other in _KINDS.values():
        if other != kind and (other.name == kind.name or other.file == kind.file):
            raise InputError(
                f"the kind of run '{kind.name}' ({kind.file}) is declared already, as "
                f"'{other.name}' ({other.file})"
            )
    _KINDS[kind.name] = kind
    return kind


def unregister(name: str) -> None:
    """Take a kind of run away, as a test does with its own.

    Parameters
    ----------
    name : str
        The name; one that is not known changes nothing.
    """
    _KINDS.pop(name, None)


def run_kind(name: str) -> RunKind:
    """Return a kind of run by its name.

    Parameters
    ----------
    name : str
        The name.

    Raises
    ------
    InputError
        When there is none of this name.

    Examples
    --------
    >>> run_kind("fit").file
    'fit.nc'
    """
    if name not in _KINDS:
        raise InputError(f"there is no kind of run '{name}': there are {', '.join(_KINDS)}")
    return _KINDS[name]


def kind_of(dataset: xr.Dataset) -> RunKind | None:
    """Return the kind of run whose result a dataset is, None for any other dataset.

    Parameters
    ----------
    dataset : xarray.Dataset
        Any dataset.
    """
    return _KINDS.get(kind_name(dataset) or "")


def answer_of(found: xr.Dataset, **more: Any) -> Answer | None:
    """Return the answer of a result as its kind of run declares it; None of any other dataset.

    Parameters
    ----------
    found : xarray.Dataset
        The main dataset of a run.
    **more
        What else the run made: ``check`` of a fit; ``reference``, ``components``, ``sobol`` of a
        sensitivity study.

    Examples
    --------
    >>> import xarray as xr
    >>> from driftwalk.schema.answers.parts import lines_of
    >>> names = {"parameter": ["drag_coefficient"], "unit": ("parameter", ["1"])}
    >>> values = {"estimate": ("parameter", [0.4]), "confidence": 0.9}
    >>> values["interval"] = (("parameter", "bound"), [[0.38, 0.42]])
    >>> answer = answer_of(xr.Dataset(values, names, {"kind": "fit"}))
    >>> lines_of(answer.parts)[0]
    'drag coefficient C_d   0.4000   90 % interval 0.3800 to 0.4200'
    """
    kind = kind_of(found)
    if kind is None or kind.answer is None:
        return None
    return with_source_warnings(load_maker(kind.answer)(found, **more), found)


def with_source_warnings(answer: Answer, found: xr.Dataset) -> Answer:
    """Return an answer with the warnings of what its parameters were taken from."""
    from driftwalk.schema.answers.facts import source_warnings

    said = source_warnings(found)
    if not said:
        return answer
    warnings = [*said, *answer.warnings]
    return answer._replace(facts={**answer.facts, "warnings": warnings}, warnings=warnings)


def following_of(found: xr.Dataset) -> Following:
    """Return what comes after a run as its kind declares it; its verdict may forbid it.

    Parameters
    ----------
    found : xarray.Dataset
        The main dataset of a run.

    Examples
    --------
    >>> import xarray as xr
    >>> following_of(xr.Dataset(attrs={"kind": "control_policy"})).command
    ('control test', 'test')
    """
    from driftwalk.schema.answers.verdict import DOES_NOT_EXPLAIN, stored_verdict

    verdict, kind = stored_verdict(found), kind_of(found)
    if verdict is not None and verdict.word == DOES_NOT_EXPLAIN:
        return Following(advice="Do not use the numbers yet: first mend what the verdict names.")
    if kind is None or kind.following is None:
        return Following()
    if isinstance(kind.following, Following):
        return kind.following
    following: Following = load_maker(kind.following)(found)
    return following


def kind_of_folder(folder: Path, specification: Mapping[str, Any]) -> RunKind | None:
    """Return the kind of a run by its specification, else by its result file; None if unknown.

    Parameters
    ----------
    folder : Path
        The run directory.
    specification : mapping
        Everything that determines its numbers; empty where nothing says it.
    """
    named = specification.get("kind")
    if isinstance(named, str) and named in _KINDS:
        return _KINDS[named]
    # Whatever has the name: its reader refuses a link that leads out.
    there = (
        kind
        for kind in _KINDS.values()
        if (folder / kind.file).is_symlink() or (folder / kind.file).exists()
    )
    return next(there, None)
