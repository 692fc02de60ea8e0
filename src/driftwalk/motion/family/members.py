"""The family of self-propelled bodies: what each member is, its parameters, and its states."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Literal

from driftwalk.motion.family.columns import Numbers, State
from driftwalk.motion.family.parts import PARAMETERS, parameters
from driftwalk.schema import Parameter


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


def _none(_: Numbers) -> Sequence[State]:
    # No lambda: models travel to other processes.
    return ()


def _state(given: Mapping[str, Any], names: str, **others: str) -> State:
    """Return a state: numbers that have its own names, and those that have others."""
    sources = {**{name: name for name in names.split()}, **others}
    return State(**{number: given[name] for number, name in sources.items()})


def _active(given: Numbers) -> Sequence[State]:
    return [_state(given, "speed rotational_diffusion turn_rate")]


def _run_tumble(given: Numbers) -> Sequence[State]:
    names = "speed speed_cv rotational_diffusion turn_rate turn_std"
    return [_state(given, names, dwell="run_time")]


def _run_rest(given: Numbers) -> Sequence[State]:
    names = "speed speed_cv rotational_diffusion turn_std"
    run = _state(given, names, dwell="run_time", dwell_cv="run_time_cv")
    return [run, State(0.0, dwell=given["rest_time"], dwell_cv=given["rest_time_cv"])]


def _burst_coast(given: Numbers) -> Sequence[State]:
    kick = _state(
        given,
        "turn_std",
        speed="kick_speed",
        speed_cv="kick_speed_cv",
        dwell="kick_time",
        dwell_cv="kick_time_cv",
        relaxation_time="glide_time",
    )
    return [replace(kick, coasting=True)]


def _two_state(given: Numbers) -> Sequence[State]:
    return [
        _state(
            given,
            "speed_cv turn_std relaxation_time",
            speed=f"{name}_speed",
            dwell=f"{name}_time",
            rotational_diffusion=f"{name}_rotational_diffusion",
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
                *parameters("speed_std memory_time"),
                replace(PARAMETERS["turn_rate"], meaning="Rate at which the velocity turns."),
            ),
            _none,
            "inertial",
        ),
        Member(
            "active",
            "Steady speed along a heading that diffuses and may turn: a robot that drives itself.",
            "dx = v e(phi) dt; dphi = turn_rate dt + sqrt(2 rotational_diffusion) dW",
            "Romanczuk et al., Eur. Phys. J. Spec. Top. 202 (2012) 1",
            parameters("speed rotational_diffusion turn_rate"),
            _active,
        ),
        Member(
            "run_tumble",
            "Runs with a speed of their own, and a turn between two of them.",
            "active, and after an exponential run_time: phi + N(0, turn_std), v drawn again",
            "Parton and Blackwell, J. Agric. Biol. Environ. Stat. 22 (2017) 368",
            parameters("speed speed_cv run_time turn_std rotational_diffusion turn_rate"),
            _run_tumble,
        ),
        Member(
            "run_rest",
            "Runs and rests in turn: beetles, mice, robots that stop.",
            "two states, v and 0; their times have Weibull laws; a run begins with a turn",
            "Michelot and Blackwell, Methods Ecol. Evol. 10 (2019) 637",
            parameters(
                "speed speed_cv run_time run_time_cv rest_time rest_time_cv turn_std "
                "rotational_diffusion"
            ),
            _run_rest,
        ),
        Member(
            "burst_coast",
            "A kick, then a glide to rest: fish.",
            "every kick_time: v = kick_speed, phi + N(0, turn_std); between: dv = -v / glide_time"
            " dt",
            "Calovi et al., PLoS Comput. Biol. 14 (2018) e1005933",
            parameters("kick_speed kick_speed_cv kick_time kick_time_cv glide_time turn_std"),
            _burst_coast,
        ),
        Member(
            "two_state",
            "Two ways of moving in turn, slow and fast.",
            "run_tumble with two sets of speed, time and diffusion; v relaxes to that of the bout",
            "Michelot and Blackwell, Methods Ecol. Evol. 10 (2019) 637",
            parameters(
                "slow_speed fast_speed speed_cv slow_time fast_time slow_rotational_diffusion "
                "fast_rotational_diffusion turn_std relaxation_time"
            ),
            _two_state,
            exchanged=(
                ("slow_speed", "fast_speed"),
                ("slow_time", "fast_time"),
                ("slow_rotational_diffusion", "fast_rotational_diffusion"),
            ),
        ),
    )
}
"""Members by name, from the simplest on."""
