"""How a message names an argument of a Python function: in backquotes, with its value as JSON.

A message of the library speaks to whoever called a Python function. The command line finds these
texts and prints its options in their place, so they have one form.
"""

from __future__ import annotations

import json
from collections.abc import Mapping


def argument_text(name: str, value: str | Mapping[str, str]) -> str:
    """Return an argument and its value as a message names them.

    A text that is the same in every message can stand there as it is. This function is for a value
    that comes from outside and may hold quotes and backquotes.

    Parameters
    ----------
    name : str
        Name of the argument.
    value : str or mapping
        What to give for it.

    Examples
    --------
    >>> print(argument_text("columns", {"t": "time:ms"}))
    `columns={"t": "time:ms"}`
    """
    text = json.dumps(value if isinstance(value, str) else dict(value), ensure_ascii=False)
    # A backquote would end the argument early; its escape means the same in Python and in JSON.
    escaped = text.replace("`", "\\u0060")
    return f"`{name}={escaped}`"
