"""OpenCV, when something needs it: an extra, so its absence is said in one line."""

from __future__ import annotations

from typing import Any

from driftwalk.core.errors import InputError


def require_opencv(purpose: str = "tracking") -> Any:
    """Return the module ``cv2``.

    Parameters
    ----------
    purpose : str
        What needs it, for the message.

    Raises
    ------
    InputError
        When OpenCV is not installed.

    Examples
    --------
    >>> require_opencv().__name__
    'cv2'
    """
    try:
        import cv2
    except ImportError as error:
        raise InputError(f"{purpose} needs OpenCV: pip install 'driftwalk[track]'") from error
    return cv2
