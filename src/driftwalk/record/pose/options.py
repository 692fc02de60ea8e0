"""Checks of the arguments about keypoints."""

from __future__ import annotations

from collections.abc import Sequence

from driftwalk.core.errors import InputError


def two_names(heading: Sequence[str] | None) -> tuple[str, str] | None:
    """Return the two points of a heading, None where there is none.

    Raises
    ------
    InputError
        When there are not two, or they are one.

    Examples
    --------
    >>> two_names(["tail", "nose"])
    ('tail', 'nose')
    """
    if heading is None:
        return None
    names = [heading] if isinstance(heading, str) else [str(name) for name in heading]
    if len(names) != 2 or names[0] == names[1] or not all(names):
        raise InputError(f"`heading` is two points, from and to; got {', '.join(names) or 'none'}")
    return names[0], names[1]
