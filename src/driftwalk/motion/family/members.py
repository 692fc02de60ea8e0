"""The family of self-propelled bodies: what each member is, its parameters, and its states."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy.typing as npt

from driftwalk.motion.family.columns import State
from driftwalk.schema import Parameter

Numbers = Mapping[str, npt.ArrayLike]


@dataclass(frozen=True)
class Member:
    """One member of the family.

    Attributes
    ----------
    name : str
        Its name.
    sentence : str
        What it is for.
    formula : str
        Its equation: heading phi, speed v, U uniform, W a Wiener process.
    source : str
        Where it is described.
    parameters : tuple of Parameter
        Its parameters.
    states : callable
        Values by name in, its states out.
    kind : {"switching", "inertial"}
        Whether it swims along a heading, or has a velocity that forgets.
    exchanged : tuple of pairs of str
        Parameters of two states that could change places: the motion would be the same. The first
        of the first pair is the smaller.
    """

    name: str
    sentence: str
    formula: str
    source: str
    parameters: tuple[Parameter, ...]
    states: Callable[[Numbers], Sequence[State]]
    kind: Literal["switching", "inertial"] = "switching"
    exchanged: tuple[tuple[str, str], ...] = ()


_SPEED = Parameter("speed", "m/s", 1e-6, 10.0, scale="log", meaning="Mean speed.")
_SPEED_CV = Parameter(
    "speed_cv", "1", 0.01, 2.0, scale="log",
    meaning="Standard deviation of the speed from bout to bout, over its mean.",
)  # fmt: skip
_DIFFUSION = Parameter(
    "rotational_diffusion", "rad2/s", 1e-4, 100.0, scale="log",
    meaning="Diffusion of the heading: after t its variance is 2 D t.",
)  # fmt: skip
_TURN_RATE = Parameter(
    "turn_rate", "rad/s", -10.0, 10.0,
    meaning="Mean rate of turning; above 0 counter-clockwise.",
)  # fmt: skip
_TURN_STD = Parameter(
    "turn_std", "rad", 0.01, 6.0, scale="log",
    meaning="Standard deviation of the turn at the beginning of a bout.",
)  # fmt: skip
_RUN_TIME = Parameter("run_time", "s", 0.05, 300.0, scale="log", meaning="Mean time of a run.")
_REST_TIME = Parameter("rest_time", "s", 0.05, 300.0, scale="log", meaning="Mean time of a rest.")
_RUN_CV = Parameter(
    "run_time_cv", "1", 0.05, 3.0, scale="log",
    meaning="Standard deviation of the time of a run over its mean; 1 is exponential.",
)  # fmt: skip
_REST_CV = replace(
    _RUN_CV,
    name="rest_time_cv",
    label="rest time cv",
    symbol="rest time cv",
    meaning="Standard deviation of the time of a rest over its mean; 1 is exponential.",
)


def _named(parameter: Parameter, name: str, meaning: str) -> Parameter:
    label = name.replace("_", " ")
    return replace(parameter, name=name, label=label, symbol=label, meaning=meaning)


def _none(_: Numbers) -> Sequence[State]:
    return ()


def _active(given: Numbers) -> Sequence[State]:
    return [
        State(
            given["speed"],
            rotational_diffusion=given["rotational_diffusion"],
            turn_rate=given["turn_rate"],
        )
    ]


def _run_tumble(given: Numbers) -> Sequence[State]:
    return [
        State(
            given["speed"],
            given["speed_cv"],
            dwell=given["run_time"],
            rotational_diffusion=given["rotational_diffusion"],
            turn_rate=given["turn_rate"],
            turn_std=given["turn_std"],
        )
    ]


def _run_rest(given: Numbers) -> Sequence[State]:
    run = State(
        given["speed"],
        given["speed_cv"],
        dwell=given["run_time"],
        dwell_cv=given["run_time_cv"],
        rotational_diffusion=given["rotational_diffusion"],
        turn_std=given["turn_std"],
    )
    return [run, State(0.0, dwell=given["rest_time"], dwell_cv=given["rest_time_cv"])]


def _burst_coast(given: Numbers) -> Sequence[State]:
    return [
        State(
            given["kick_speed"],
            given["kick_speed_cv"],
            dwell=given["kick_time"],
            dwell_cv=given["kick_time_cv"],
            relaxation_time=given["glide_time"],
            coasting=True,
            turn_std=given["turn_std"],
        )
    ]


def _two_state(given: Numbers) -> Sequence[State]:
    return [
        State(
            given[f"{name}_speed"],
            given["speed_cv"],
            dwell=given[f"{name}_time"],
            rotational_diffusion=given[f"{name}_rotational_diffusion"],
            turn_std=given["turn_std"],
            relaxation_time=given["relaxation_time"],
        )
        for name in ("slow", "fast")
    ]


MEMBERS: Final[Mapping[str, Member]] = {
    member.name: member
    for member in (
        Member(
            "inertial",
            "A velocity that relaxes and is stirred: a drifting body, or a smooth swimmer.",
            "dw = -w / memory_time dt + turn_rate x w dt + speed_std sqrt(2 / memory_time) dW;"
            " dx = (w + u) dt",
            "Gurarie et al., Movement Ecology 5 (2017) 13",
            (
                Parameter(
                    "speed_std", "m/s", 1e-6, 10.0, scale="log",
                    meaning="Standard deviation of each component of the velocity.",
                ),
                Parameter(
                    "memory_time", "s", 0.01, 300.0, scale="log",
                    meaning="Time over which the velocity is remembered.",
                ),
                replace(_TURN_RATE, meaning="Rate at which the velocity turns."),
            ),
            _none,
            "inertial",
        ),
        Member(
            "active",
            "Steady speed along a heading that diffuses and may turn: a robot that drives itself.",
            "dx = v e(phi) dt; dphi = turn_rate dt + sqrt(2 rotational_diffusion) dW",
            "Romanczuk et al., Eur. Phys. J. Spec. Top. 202 (2012) 1",
            (_SPEED, _DIFFUSION, _TURN_RATE),
            _active,
        ),
        Member(
            "run_tumble",
            "Runs with a speed of their own, and a turn between two of them.",
            "active, and after an exponential run_time: phi + N(0, turn_std), v drawn again",
            "Parton and Blackwell, J. Agric. Biol. Environ. Stat. 22 (2017) 368",
            (_SPEED, _SPEED_CV, _RUN_TIME, _TURN_STD, _DIFFUSION, _TURN_RATE),
            _run_tumble,
        ),
        Member(
            "run_rest",
            "Runs and rests in turn: beetles, mice, robots that stop.",
            "two states, v and 0; their times have Weibull laws; a run begins with a turn",
            "Michelot and Blackwell, Methods Ecol. Evol. 10 (2019) 637",
            (_SPEED, _SPEED_CV, _RUN_TIME, _RUN_CV, _REST_TIME, _REST_CV, _TURN_STD, _DIFFUSION),
            _run_rest,
        ),
        Member(
            "burst_coast",
            "A kick, then a glide to rest: fish.",
            "every kick_time: v = kick_speed, phi + N(0, turn_std); between: dv = -v / glide_time"
            " dt",
            "Calovi et al., PLoS Comput. Biol. 14 (2018) e1005933",
            (
                _named(_SPEED, "kick_speed", "Mean speed right after a kick."),
                _named(_SPEED_CV, "kick_speed_cv", "Its standard deviation over the mean."),
                _named(_RUN_TIME, "kick_time", "Mean time between kicks."),
                _named(
                    _RUN_CV, "kick_time_cv",
                    "Standard deviation of the time between kicks over its mean.",
                ),
                Parameter(
                    "glide_time", "s", 0.02, 100.0, scale="log",
                    meaning="Time over which the speed of a glide falls by e.",
                ),
                _TURN_STD,
            ),
            _burst_coast,
        ),
        Member(
            "two_state",
            "Two ways of moving in turn, slow and fast.",
            "run_tumble with two sets of speed, time and diffusion; v relaxes to that of the bout",
            "Michelot and Blackwell, Methods Ecol. Evol. 10 (2019) 637",
            (
                _named(_SPEED, "slow_speed", "Mean speed of a slow bout."),
                _named(_SPEED, "fast_speed", "Mean speed of a fast bout."),
                _SPEED_CV,
                _named(_RUN_TIME, "slow_time", "Mean time of a slow bout."),
                _named(_RUN_TIME, "fast_time", "Mean time of a fast bout."),
                _named(
                    _DIFFUSION, "slow_rotational_diffusion", "Diffusion of the heading while slow."
                ),
                _named(
                    _DIFFUSION, "fast_rotational_diffusion", "Diffusion of the heading while fast."
                ),
                _TURN_STD,
                Parameter(
                    "relaxation_time", "s", 0.01, 30.0, scale="log",
                    meaning="Time over which the speed comes to that of the bout.",
                ),
            ),
            _two_state,
            exchanged=(
                ("slow_speed", "fast_speed"),
                ("slow_time", "fast_time"),
                ("slow_rotational_diffusion", "fast_rotational_diffusion"),
            ),
        ),
    )
}  # fmt: skip
"""Members by name, from the simplest on."""
