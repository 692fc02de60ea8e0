"""How an error reaches the user: one line on stderr and an exit code, no traceback.

``DRIFTWALK_DEBUG=1`` in the environment shows the traceback instead. An error that driftwalk does
not know is a fault of driftwalk, and always shows its traceback.
"""

from __future__ import annotations

import contextlib
import errno
import os
import sys
from typing import Any

import typer

from driftwalk.cli.terminal.argument_names import to_options
from driftwalk.core.errors import DriftwalkError

EXIT_USER_ERROR = 2
"""Of a wrong use, as POSIX shells and Click have it."""
EXIT_INTERRUPTED = 130
"""128 and the number of SIGINT, as shells have it."""
EXIT_BROKEN_PIPE = 141
"""128 and the number of SIGPIPE, as shells have it."""
# What other programs call an option, and what it is here.
_SYNONYMS = {
    **dict.fromkeys(("--arena", "--tank-diameter", "--diameter"), "--tank"),
    **dict.fromkeys(("--frame-rate", "--image-rate"), "--fps"),
    **dict.fromkeys(("--metres-per-pixel", "--px-per-m", "--pixel-size"), "--scale"),
    "--live": "ADDRESS:PORT",
    "--run": "--replicate",
}
_LONGEST = 1500
"""Characters of a message; it may quote what a file holds; chosen by hand."""


class PastTyper(Exception):
    """Carries its cause, an interrupt or a broken pipe, past typer, which would swallow it."""


def exit_code_of(error: BaseException) -> int:
    """Report an error on one line of stderr and return the exit code.

    Parameters
    ----------
    error : BaseException
        The error that ended a command.

    Returns
    -------
    int
        2 for a mistake in the input, the options or the files; 130 for an interrupt; 141 for
        a reader of the output that has gone, which is silent.

    Raises
    ------
    BaseException
        The error itself, when it is none of these or ``DRIFTWALK_DEBUG`` is set.
    """
    if isinstance(error, PastTyper) and error.__cause__ is not None:
        error = error.__cause__
    if isinstance(error, BrokenPipeError):
        _silence_stdout()
        return EXIT_BROKEN_PIPE
    if os.environ.get("DRIFTWALK_DEBUG", "0") not in ("", "0"):
        raise error
    if isinstance(error, (KeyboardInterrupt, typer.Abort)):
        _print_line("interrupted")
        return EXIT_INTERRUPTED
    line = one_line(error)
    if line is None:
        raise error
    _print_line(f"error: {line}")
    return EXIT_USER_ERROR


def one_line(error: BaseException) -> str | None:
    """Return the message of an error that is the user's to mend, on one line; else None."""
    if isinstance(error, DriftwalkError):
        return _joined(to_options(str(error)))
    if isinstance(error.__cause__, DriftwalkError) and _is_of_a_sweep(error):
        return _joined(to_options(f"{error.__cause__}; what was finished is kept"))
    if hasattr(error, "format_message"):  # what typer raises for a mistake in the options
        return _usage_message(error)
    if isinstance(error, MemoryError):
        # What C++ says of itself names neither size nor remedy.
        said = "" if str(error) == "std::bad_alloc" else str(error)
        return _joined(f"there is not enough memory for this: {to_options(said)}".rstrip(": "))
    if isinstance(error, OSError):
        return _joined(_operating_system_message(error))
    return None


def _is_of_a_sweep(error: BaseException) -> bool:
    """Return whether a unit of a sweep failed, such as one that runs a user's model."""
    from driftwalk.sweep import SweepError

    return isinstance(error, SweepError)


def _usage_message(error: Any) -> str:
    message = _joined(to_options(error.format_message()))
    context = getattr(error, "ctx", None)
    if context is None:
        return message
    message = message.rstrip(".")
    option = getattr(error, "option_name", None)
    wanted = _SYNONYMS.get(option or "")
    known = {name for one in context.command.params for name in one.opts}
    if wanted is not None and (not wanted.startswith("--") or wanted in known):
        message = f"{message.partition(' (Possible')[0]}; did you mean {wanted}?"
    return f"{message} (see '{context.command_path} --help{'' if option is None else '-all'}')"


def _operating_system_message(error: OSError) -> str:
    reason = error.strerror or str(error) or type(error).__name__
    if error.errno == errno.ENOENT:
        reason = "no such file or directory"
    elif error.errno == errno.ENOSPC:
        reason = "no space left on the disk"
    return f"{error.filename}: {reason}" if error.filename is not None else reason


def _joined(text: str) -> str:
    """Return a text on one line that is not endless and leaves the terminal as it is."""
    line = " ".join(text.split())
    if len(line) > _LONGEST:
        half = _LONGEST // 2
        line = f"{line[:half]} … {line[-half:]}"
    return "".join(character if character.isprintable() else "\ufffd" for character in line)


def _silence_stdout() -> None:
    """Keep the interpreter from complaining when it flushes a closed pipe."""
    with contextlib.suppress(OSError), open(os.devnull, "w", encoding="utf-8") as nowhere:  # noqa: PTH123
        os.dup2(nowhere.fileno(), sys.stdout.fileno())


def _print_line(text: str) -> None:
    print(f"driftwalk: {text}", file=sys.stderr, flush=True)
