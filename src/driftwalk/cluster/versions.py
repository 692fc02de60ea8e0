"""Workers must be of the same driftwalk and give the same bits: other numbers are no result."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from driftwalk.cluster.probe import SameBits, probe_digest, refuse_other_bits
from driftwalk.core.errors import ClusterError
from driftwalk.core.provenance import package_versions
from driftwalk.sweep import refuse_others


def refuse_other_workers(client: Any) -> SameBits:
    """Raise where a worker has another version of driftwalk, or none, or gives other bits.

    Parameters
    ----------
    client : distributed.Client
        Of the workers.

    Returns
    -------
    SameBits
        The same check for workers that come later.

    Raises
    ------
    ClusterError
        Names the worker, and both versions or both hashes.
    """
    wanted = package_versions(["driftwalk"])
    # A function of the standard library: one of driftwalk's own would not run where it is missing.
    for worker, found in _asked(client, version, "driftwalk"):
        there = None if isinstance(found, PackageNotFoundError) else str(found)
        refuse_others(wanted, {"driftwalk": there}, worker)
    expected = probe_digest()
    for worker, found in _asked(client, probe_digest):
        refuse_other_bits(expected, found, worker)
    return SameBits(expected)


def _asked(client: Any, function: Callable[..., Any], *arguments: Any) -> Iterator[tuple[str, Any]]:
    """Call a function on every worker, and give its name and what it said."""
    for address, found in client.run(function, *arguments, on_error="return").items():
        worker = f"the worker {address}"
        if isinstance(found, BaseException) and not isinstance(found, PackageNotFoundError):
            raise ClusterError(f"{worker} does not answer: {type(found).__name__}: {found}")
        yield worker, found
