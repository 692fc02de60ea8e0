"""A motion model that is a program in any language: it answers lines of JSON with positions."""

from __future__ import annotations

import math
import os
import shlex
import shutil
import tempfile
import weakref
from collections import deque
from collections.abc import Callable, Mapping
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from contextlib import suppress
from dataclasses import replace
from itertools import count
from pathlib import Path
from threading import Event, Lock
from typing import TYPE_CHECKING, Any, Final, TypeVar

import numpy as np

from driftwalk.conditions.recorded import Conditions
from driftwalk.core.arrays import Keys
from driftwalk.core.errors import ConfigurationError, InputError, did_you_mean
from driftwalk.core.provenance import file_sha256
from driftwalk.core.text_files import text_of_name
from driftwalk.motion.camera import observe_worlds
from driftwalk.motion.external_program.lines import (
    PARAMETERS_REQUEST,
    Positions,
    read_parameters,
    read_positions,
    world_request,
)
from driftwalk.motion.external_program.process import (
    Program,
    ProgramEnded,
    ProgramFault,
    close_programs,
)
from driftwalk.motion.protocol import Values, Worlds, in_words, world_batches
from driftwalk.motion.ranges import Given, with_given

if TYPE_CHECKING:
    import xarray as xr

FLOW_KEYS: Final = {"x_m": "x", "y_m": "y", "u_m_s": "u", "v_m_s": "v"}
"""From the arrays of the file to the variables of a `flow_field`."""


class FlowFile:
    """A file with the flow that programs read, in a temporary folder that ends with this object.

    It is written when it is first asked for, and again when the flow is another one.

    Examples
    --------
    >>> import driftwalk as dw
    >>> flow, flow_file = dw.tank30_flow(), FlowFile()
    >>> with np.load(flow_file.path_of(flow)) as stored:
    ...     sorted(stored)
    ['u_m_s', 'v_m_s', 'x_m', 'y_m']
    >>> flow_file.path_of(flow) == flow_file.path_of(flow)
    True
    """

    def __init__(self) -> None:
        self._folder: str | None = None
        self._written: list[tuple[xr.Dataset, str]] = []
        self._lock = Lock()

    def path_of(self, flow: xr.Dataset) -> str:
        """Return the path of the file with a flow.

        Parameters
        ----------
        flow : xarray.Dataset
            A `flow_field`.
        """
        with self._lock:
            for known, path in self._written:
                if known is flow:
                    return path
            if self._folder is None:
                self._folder = tempfile.mkdtemp(prefix="driftwalk-flow-")
                weakref.finalize(self, shutil.rmtree, self._folder, ignore_errors=True)
            path = str(Path(self._folder) / f"flow-{len(self._written) + 1}.npz")
            arrays = {key: flow[name].to_numpy() for key, name in FLOW_KEYS.items()}
            np.savez(path, allow_pickle=False, **arrays)
            self._written.append((flow, path))
            return path


TIMEOUT_S = 60.0
"""Time for an answer [s], so that a program that hangs ends a run; chosen by hand."""

PROBED_WORLDS: Final = np.array([1, 2], dtype=np.uint64)
"""Two worlds, and the second alone: a world must not depend on what is simulated with it."""
SCRIPTS: Final = (".py", ".jl", ".r", ".m", ".js", ".lua", ".rb", ".sh")
"""Names of files that an interpreter runs, by which a program is called rather than by that."""


T = TypeVar("T")


class ProgramModel:
    """A motion model that is an external program; see `motion_model`.

    The program is started when the model is made, and kept open. It reads one line of JSON per
    request and writes one line per answer. As many copies run as threads ask. Before the first
    request a copy has to make a world twice, alone and next to another one: a world is a function
    of its seed.

    Parameters
    ----------
    command : str
        The program and its arguments as in a shell, from the current folder: "./simulator fast".
    given : mapping of str to Parameter or tuple
        Ranges in place of those that the program names, by parameter.
    timeout : float
        Longest time that an answer may take [s].

    Raises
    ------
    ConfigurationError
        When the program cannot be started, a range is none, or it has no such parameter.
    InputError
        When it does not name its parameters.

    Examples
    --------
    >>> model = ProgramModel("./simulator", {"speed": (0.01, 0.1, "m/s")})  # doctest: +SKIP
    >>> model.name, model.parameters[0].key  # doctest: +SKIP
    ('simulator', 'speed_m_s')
    """

    needs_flow = False

    def __init__(
        self, command: str, given: Given | None = None, *, timeout: float = TIMEOUT_S
    ) -> None:
        if not (math.isfinite(timeout) and timeout > 0.0):
            raise ConfigurationError(f"`timeout` is {timeout}, expected a time above 0 s")
        self.command = command
        self.words = program_words(command)
        self.folder = str(Path.cwd())
        self.timeout = float(timeout)
        self.file = _program_file(self.words)
        self.name = Path(self.file).stem
        # Taken now: these are the files of the copy that is started now.
        self.files_sha256 = _hashes(self.words)
        self._open()
        usual = self._use(lambda program: read_parameters(program.greeting), Event())
        for name in given or {}:
            if name not in usual:
                raise ConfigurationError(
                    f"the program {command!r} has no parameter {name!r}, it has "
                    f"{', '.join(usual)}{did_you_mean(name, usual)}"
                )
        self.parameters = with_given(usual, given or {})

    def simulate(self, values: Values, like: Conditions, keys: Keys) -> Worlds:
        """Return one world per key; see `MotionModel.simulate`.

        Raises
        ------
        InputError
            When the program hangs, dies twice, answers something else than positions, or makes
            another world when it is asked again.
        """
        batches = world_batches(
            [values[one.name] for one in self.parameters],
            # Some 10 MB of JSON for each request.
            most=max(200_000 // like.sample_time.size, 1),
            one_setting=True,
        )
        stop = Event()
        with ThreadPoolExecutor(min(like.threads, len(batches))) as executor:
            futures = [
                executor.submit(self._batch, values, like, keys, batch, stop) for batch in batches
            ]
            try:
                for future in wait(futures, return_when=FIRST_EXCEPTION).done:
                    future.result()
            except BaseException:
                # An error, or Ctrl-C: the other requests end too, and none begins.
                stop.set()
                executor.shutdown(cancel_futures=True)
                raise
        parts = [future.result() for future in futures]
        return Worlds(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))

    def describe(self) -> dict[str, Any]:
        """Return its name, parameters and command, and the hashes of the files in the command."""
        return {
            "name": self.name,
            "parameters": [parameter.describe() for parameter in self.parameters],
            "command": text_of_name(self.command),
            "files_sha256": {text_of_name(word): one for word, one in self.files_sha256.items()},
        }

    def facts(self, estimate: Mapping[str, float]) -> dict[str, Any]:  # noqa: ARG002
        """Return which program it was: its name, and the hash of its file where it is one."""
        source = self.files_sha256.get(self.file)
        return {"model": self.name, **({} if source is None else {"model_source_sha256": source})}

    def __getstate__(self) -> dict[str, Any]:
        """Return everything but the running copies: another process starts its own."""
        return {name: value for name, value in vars(self).items() if not name.startswith("_")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._open()

    def _open(self) -> None:
        # Copies that wait, each used by one thread at a time; they end with the model, and at the
        # latest with this process. The ends of a deque are safe for several threads: `append` and
        # `pop` are one operation each.
        self._idle: deque[Program] = deque()
        weakref.finalize(self, close_programs, self._idle)
        self._flow_file = FlowFile()
        self._numbers = count(1)
        self._lock = Lock()
        self._probed_like: Conditions | None = None
        self._probed: Positions | None = None

    def _batch(
        self, values: Values, like: Conditions, keys: Keys, batch: slice, stop: Event
    ) -> Worlds:
        setting = {one.name: float(values[one.name][batch][0]) for one in self.parameters}
        own = keys[batch]

        def positions(program: Program) -> Positions:
            if not program.repeats:
                self._require_repeats(program, like, stop)
                program.repeats = True
            return self._ask(program, setting, like, own, stop)

        return observe_worlds(*self._use(positions, stop), like, own)

    def _ask(
        self,
        program: Program,
        setting: Mapping[str, float],
        like: Conditions,
        keys: Keys,
        stop: Event,
    ) -> Positions:
        flow = None if like.flow is None else self._flow_file.path_of(like.flow)
        request = world_request(next(self._numbers), setting, like, keys, flow=flow)
        return read_positions(program.ask(request, timeout=self.timeout, stop=stop), request)

    def _require_repeats(self, program: Program, like: Conditions, stop: Event) -> None:
        """Let a copy make two short worlds, and the second one alone: as before, as other copies.

        All copies make the worlds of the conditions that the model is first used under.
        """
        with self._lock:
            if self._probed_like is None:
                self._probed_like = replace(like, sample_time=like.sample_time[:8])
            short = self._probed_like
        middle = {
            one.name: float(one.to_value(one.to_coordinate([one.low, one.high]).mean()))
            for one in self.parameters
        }
        both = self._ask(program, middle, short, PROBED_WORLDS, stop)
        alone = self._ask(program, middle, short, PROBED_WORLDS[1:], stop)
        where = f"at {in_words(middle)}"
        if not (np.isfinite(both.x).any() and np.isfinite(both.y).any()):
            raise ProgramFault(where, "none of its positions is a number")
        with self._lock:
            self._probed = self._probed or both
            first = self._probed
        if not (_same(both, first) and _same(_last(both), alone)):
            raise ProgramFault(
                where,
                "it is not reproducible: the same seed gave other positions when it was asked "
                "again; take all random numbers from a generator that starts with the seed of its "
                "world",
            )

    def _use(self, work: Callable[[Program], T], stop: Event) -> T:
        """Return the result of some requests to one copy; if it dies, another one gets them.

        Parameters
        ----------
        work : callable
            Makes the requests.
        stop : Event
            Ends the requests when it is set.

        Raises
        ------
        InputError
            When a request fails, or two copies died.
        """
        try:
            try:
                return self._use_one(work, stop)
            except ProgramEnded:
                return self._use_one(work, stop)
        except ProgramFault as fault:
            twice = ", twice" if isinstance(fault, ProgramEnded) else ""
            raise InputError(
                f"the program {self.command!r} failed {fault.where}{twice}: {fault.reason}"
            ) from fault

    def _use_one(self, work: Callable[[Program], T], stop: Event) -> T:
        program = self._waiting() or Program(self.words, self.folder)
        try:
            if not program.greeting:
                program.greeting = program.ask(PARAMETERS_REQUEST, timeout=self.timeout, stop=stop)
            result = work(program)
        except BaseException:
            # What it would write next is unknown.
            program.close()
            raise
        self._idle.append(program)
        return result

    def _waiting(self) -> Program | None:
        with suppress(IndexError):
            while True:
                program = self._idle.pop()
                # A copy of this process by fork shares the pipes of its parent's programs.
                if program.is_own:
                    return program
        return None


def program_words(command: str, *, separator: str = os.sep) -> tuple[str, ...]:
    """Return the words of a command, as a shell reads them; on Windows a backslash is of a path."""
    lexer = shlex.shlex(command, posix=True)
    lexer.whitespace_split = True
    lexer.commenters = ""
    if separator == "\\":
        lexer.escape = ""
    try:
        words = tuple(lexer)
    except ValueError as error:
        raise ConfigurationError(f"the command {command!r} is no command: {error}") from error
    if not words:
        raise ConfigurationError("name the program: 'command:./simulator'")
    return words


def _program_file(words: tuple[str, ...]) -> str:
    """Return the word that names the program: a script, or else the first word."""
    scripts = (word for word in words[1:] if word.lower().endswith(SCRIPTS) and _is_file(word))
    return next(scripts, words[0])


def _hashes(words: tuple[str, ...]) -> dict[str, str]:
    """Return the hash of each word that is a file: the program, its script, its input.

    A first word without a folder is looked for on the path, and differs between machines.
    """
    files = (word for word in words if _is_file(word) and (word != words[0] or os.sep in word))
    return {word: file_sha256(word) for word in files}


def _is_file(word: str) -> bool:
    try:
        return Path(word).is_file()
    except OSError:
        return False  # too long for a name: an argument


def _last(positions: Positions) -> Positions:
    x, y, theta = positions
    return Positions(x[-1:], y[-1:], None if theta is None else theta[-1:])


def _same(one: Positions, other: Positions) -> bool:
    return all(
        a is b or (a is not None and b is not None and np.array_equal(a, b, equal_nan=True))
        for a, b in zip(one, other, strict=True)
    )
