"""The part of a page on how a recording was tracked: frames and rejected candidates."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from driftwalk.page.parts import Section, figure, section

COUNTED: Final = {
    "frames": ("frames tracked", None),
    "dropped": ("frames dropped", "lost before processing"),
    "duplicates": ("frames doubled", "no later than the one before, left out"),
    "stale": ("frames stale", "the same image as the one before, left out"),
    "taken_back": ("positions taken back", "rejected as something else"),
}


def tracking_sections(tracking: Mapping[str, Any] | None) -> list[Section]:
    """Return the section on the tracking of a recording, none of one that was not tracked here.

    Parameters
    ----------
    tracking : mapping or None
        ``tracking`` of what `driftwalk.describe` returns.

    Examples
    --------
    >>> tracking_sections(None)
    []
    >>> (part,) = tracking_sections({"tracked_from": "v.mp4", "complete": True, "frames": 9})
    >>> part["numbers"][0]["value"]
    9.0
    """
    if tracking is None:
        return []
    words = [f"Tracked from {tracking.get('tracked_from') or 'an unnamed source'}."]
    rejected = tracking.get("rejected") or {}
    if rejected:
        listed = ", ".join(f"{reason} {number}" for reason, number in rejected.items())
        words.append(f"Candidates rejected, over all frames: {listed}.")
    numbers = [
        figure(label, tracking[key], note=note)
        for key, (label, note) in COUNTED.items()
        if key in tracking
    ]
    return [section("tracking", "summary", "Tracking", paragraphs=words, numbers=numbers)]


def tracking_warnings(tracking: Mapping[str, Any] | None) -> list[str]:
    """Return what a reader has to know of the tracking: that it ended early.

    Examples
    --------
    >>> tracking_warnings({"complete": False, "interrupted": "the disk is full"})
    ['the tracking broke off: the disk is full']
    >>> tracking_warnings({"complete": True, "interrupted": None}), tracking_warnings(None)
    ([], [])
    """
    if tracking is None or tracking.get("complete", True):
        return []
    reason = tracking.get("interrupted")
    ending = "" if reason is None else f": {reason}"
    return [f"the tracking broke off{ending}"]
