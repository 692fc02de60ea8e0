"""The flow field for programs: a file of arrays, as it is too large for every request."""

from __future__ import annotations

import shutil
import tempfile
import weakref
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Final

import numpy as np

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
