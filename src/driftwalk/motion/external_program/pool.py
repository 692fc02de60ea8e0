"""The running copies of a program: one for each request that is under way, kept for the next."""

from __future__ import annotations

import weakref
from collections import deque
from collections.abc import Callable
from threading import Event
from typing import TypeVar

from driftwalk.core.errors import InputError
from driftwalk.motion.external_program.lines import PARAMETERS_REQUEST
from driftwalk.motion.external_program.process import (
    Program,
    ProgramEnded,
    ProgramFault,
    Request,
    close_programs,
)

T = TypeVar("T")


class ProgramPool:
    """Running copies of a program, each used by one thread at a time.

    They end with the pool, and at the latest with this process.

    Parameters
    ----------
    command : str
        The command as the user wrote it, for messages.
    words : tuple of str
        The command.
    folder : str
        The folder that it runs in.
    timeout : float
        Longest time that an answer may take [s].
    """

    def __init__(self, command: str, words: tuple[str, ...], folder: str, timeout: float) -> None:
        self.command = command
        self.words = words
        self.folder = folder
        self.timeout = timeout
        # Its ends are safe for several threads: `append` and `pop` are one operation each.
        self._idle: deque[Program] = deque()
        weakref.finalize(self, close_programs, self._idle)

    def use(self, work: Callable[[Program], T], stop: Event) -> T:
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
                return self._use(work, stop)
            except ProgramEnded:
                return self._use(work, stop)
        except ProgramFault as fault:
            twice = ", twice" if isinstance(fault, ProgramEnded) else ""
            raise InputError(
                f"the program {self.command!r} failed {fault.where}{twice}: {fault.reason}"
            ) from fault

    def ask(self, program: Program, request: Request, stop: Event) -> bytes:
        """Return the answer of one copy to a request."""
        return program.ask(request, timeout=self.timeout, stop=stop)

    def _use(self, work: Callable[[Program], T], stop: Event) -> T:
        program = self._waiting() or Program(self.words, self.folder)
        try:
            if not program.greeting:
                program.greeting = self.ask(program, PARAMETERS_REQUEST, stop)
            result = work(program)
        except BaseException:
            # Nobody knows what it would write next.
            program.close()
            raise
        self._idle.append(program)
        return result

    def _waiting(self) -> Program | None:
        while self._idle:
            try:
                program = self._idle.pop()
            except IndexError:
                return None
            # A copy of this process by fork shares the pipes of its parent's programs.
            if program.is_own:
                return program
        return None
