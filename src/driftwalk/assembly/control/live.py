"""A controller of one real tank: frames of a tracker's stream in, decisions out."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.assembly.control.plan import stored_modes, stored_rules, stored_wanted
from driftwalk.assembly.control.worlds import UNKNOWN, Controller, ages
from driftwalk.core.errors import InputError
from driftwalk.schema.shapes import is_one_assembly

if TYPE_CHECKING:
    import xarray as xr


class LiveControl:
    """Follows a policy in one tank.

    Parameters
    ----------
    policy : xarray.Dataset
        A `control_policy`.

    Raises
    ------
    InputError
        When the dataset is no policy.

    Examples
    --------
    ``LiveControl(policy).frame({"type": "frame", "time_s": 0.0, "outcome": "1+1+1+1"})``
    """

    def __init__(self, policy: xr.Dataset) -> None:
        self._rules = stored_rules(policy)
        self._wanted, self._modes = stored_wanted(policy), stored_modes(policy)
        self._number = {str(name): at for at, name in enumerate(policy["class"].values)}
        self._tank = (json.loads(policy.attrs["arena"]), float(policy.attrs["block_side_m"]))
        self.blocks = int(policy.attrs["blocks"])
        self._bonds_break = self._modes.study.assembly.bonds_break
        self._begun = self._since = math.nan
        self._last, self._due, self._outcome, self.ended = math.inf, 0.0, "", False
        self._controller = Controller(self._rules, np.zeros(1, dtype=np.int64))

    def hello(self, content: Mapping[str, Any]) -> None:
        """Take the first line of a stream.

        Raises
        ------
        InputError
            When it is that of another tank, or of other blocks.
        """
        arena, side = self._tank
        theirs = content.get("tank")
        if theirs is not None and not _same_tank(arena, theirs):
            raise InputError(
                f"the stream is of another tank: {_words(theirs)}, and the policy was planned for "
                f"{_words(arena)}"
            )
        size = content.get("block_side_m")
        if size is not None and abs(float(size) / side - 1.0) > 0.01:
            raise InputError(
                f"the stream has blocks of {size:g} m, and the policy was planned for {side:g} m"
            )
        self._require_blocks(content.get("body_count"))

    def frame(self, content: Mapping[str, Any]) -> dict[str, Any] | None:
        """Take a frame; return the decision that is due, or the end, None where there is none.

        Raises
        ------
        InputError
            When the tank holds another number of blocks.
        """
        time = float(content["time_s"])
        if not time >= self._last:  # `_last` is infinite before the first
            # The first frame, or a tank that was restarted.
            self._restart(time)
            if "bodies" in content:
                self._require_blocks(len(content["bodies"]))
        self._last = time
        outcome = str(content.get("outcome") or "")
        if outcome and outcome != self._outcome:
            began = self._outcome == ""
            self._outcome, self._since = outcome, self._begun if began else time
        if self.ended:
            return None
        spent = time - self._begun
        done = is_one_assembly(self._outcome or "+") and not self._bonds_break
        if done or spent >= self._wanted.by_s:
            return self.end()
        if spent < self._due:
            return None
        every = self._wanted.every_s
        period = min(math.floor(spent / every + 1e-6), self._wanted.periods - 1)
        self._due = every * (period + 1)
        return self._decide(outcome, time, self._wanted.periods - period)

    def end(self) -> dict[str, Any]:
        """Return the line of the end, by the last frame; its time is None where none came."""
        self.ended = True
        return {
            "type": "end", "time_s": self._last if math.isfinite(self._last) else None,
            "class": self._outcome, "reached": self._outcome == self._wanted.target,
            **self._mode(self._rules.safe),
        }  # fmt: skip

    def safe(self, why: str) -> dict[str, Any]:
        """Return the line of the safe mode, for a stream that has stopped."""
        self._controller.mode[:] = self._rules.safe
        return {"type": "safe", "reason": why, **self._mode(self._rules.safe)}

    def _decide(self, outcome: str, time: float, left: int) -> dict[str, Any]:
        seen = np.array([self._number.get(outcome, UNKNOWN)])
        age = ages(np.array([time - self._since]), self._wanted.every_s)
        mode = int(self._controller.decide(seen, age, left=left)[0])
        return {
            "type": "decision",
            "time_s": time,
            "left_s": self._begun + self._wanted.by_s - time,
            "class": outcome,
            "time_in_class_s": time - self._since,
            "reason": "policy" if seen[0] != UNKNOWN else "class unknown, mode held",
            **self._mode(mode),
        }

    def _mode(self, mode: int) -> dict[str, Any]:
        modes = self._modes
        return {
            "mode": modes.name[mode],
            "flow": int(modes.flow[mode]),
            "flow_scale": float(modes.flow_scale[mode]),
            "force_std_N": float(modes.force_std[mode, 0]),
        }

    def _restart(self, time: float) -> None:
        self._begun = self._since = time
        self._due, self._outcome, self.ended = 0.0, "", False
        self._controller = Controller(self._rules, np.zeros(1, dtype=np.int64))

    def _require_blocks(self, number: Any) -> None:
        if number is not None and int(number) != self.blocks:
            raise InputError(
                f"the stream has {number} blocks, and the policy was planned for {self.blocks}"
            )


def _same_tank(ours: Mapping[str, Any], theirs: Mapping[str, Any]) -> bool:
    """Return whether two tanks have the same shape and, within 1 %, the same size."""
    sizes = [key for key in ours if key.endswith("_m") and not key.startswith("center")]
    return theirs.get("shape") == ours.get("shape") and all(
        key in theirs
        and np.shape(theirs[key]) == np.shape(ours[key])
        and np.allclose(np.asarray(theirs[key], float), np.asarray(ours[key], float), rtol=0.01)
        for key in sizes
    )


def _words(arena: Mapping[str, Any]) -> str:
    sizes = (f"{key.removesuffix('_m')} {value} m" for key, value in arena.items() if "_m" in key)
    return ", ".join([str(arena.get("shape")), *(text for text in sizes if "center" not in text)])
