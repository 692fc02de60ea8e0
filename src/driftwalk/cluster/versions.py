"""Workers must be of the same driftwalk: numbers of another version are other numbers."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version
from typing import Any

from driftwalk.core.errors import ClusterError
from driftwalk.core.provenance import package_versions
from driftwalk.sweep import refuse_others


def refuse_other_workers(client: Any) -> None:
    """Raise where a worker has another version of driftwalk, or none.

    Workers that come later are checked with each unit.

    Parameters
    ----------
    client : distributed.Client
        Of the workers.

    Raises
    ------
    ClusterError
        Names the worker and both versions.
    """
    wanted = package_versions(["driftwalk"])
    # A function of the standard library: one of driftwalk's own would not run where it is missing.
    for worker, found in client.run(version, "driftwalk", on_error="return").items():
        if isinstance(found, PackageNotFoundError):
            found = None
        elif isinstance(found, BaseException):
            raise ClusterError(f"the worker {worker} does not answer: {found}")
        refuse_others(wanted, {"driftwalk": found}, f"the worker {worker}")
