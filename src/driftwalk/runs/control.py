"""The runs of control: a policy is planned, and tested in fresh worlds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

from driftwalk.core.provenance import plain
from driftwalk.runs.resumable_run import dataset_hash

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.assembly import Modes
    from driftwalk.assembly.control.worlds import Wanted
    from driftwalk.model import Study
    from driftwalk.runs.resumable_run import Run


@dataclass(frozen=True)
class ControlPlanWork:
    """The plan of a policy.

    Attributes
    ----------
    modes : Modes
        The modes.
    wanted : Wanted
        Target, deadline, latency, missed looks and dwell.
    rounds, worlds, seed : int
        As `driftwalk.assembly.plan_control` takes them.
    inputs : mapping of str to Path
        The files that were read, by their role.
    """

    modes: Modes
    wanted: Wanted
    rounds: int
    worlds: int
    seed: int
    inputs: Mapping[str, Path] = field(default_factory=dict)

    kind: ClassVar = "control_policy"

    @property
    def study(self) -> Study:
        """The study of the modes."""
        return self.modes.study

    @property
    def seeds(self) -> dict[str, int]:
        """The seed of the worlds."""
        return {"control": self.seed}

    def checked(self) -> Self:
        """Refuse a target of other blocks and times out of range; name the target as runs do."""
        from driftwalk.assembly import check_control

        return replace(self, wanted=check_control(self.modes, self.wanted))

    def specification(self) -> dict[str, Any]:
        """Return what determines the numbers."""
        modes = self.modes
        numbers = (modes.flow, modes.flow_scale, modes.force_std, modes.drag_coefficient)
        columns = (column.tolist() for column in numbers)
        return {
            "study": modes.study.to_dict(),
            "flows_sha256": [dataset_hash(one, ("u", "v")) for one in modes.flows],
            "modes": [list(row) for row in zip(modes.name, *columns, strict=True)],
            "wanted": vars(self.wanted),
            "rounds": self.rounds,
            "worlds": self.worlds,
            "seed": self.seed,
        }

    def compute(self, run: Run) -> xr.Dataset:
        """Plan the policy and keep it."""
        from driftwalk.assembly import plan_control

        wanted = self.wanted
        found = plan_control(
            self.modes, wanted.target, wanted.by_s, every=wanted.every_s,
            latency=wanted.latency_s, missed=wanted.missed, dwell=wanted.dwell_s,
            rounds=self.rounds, worlds=self.worlds, seed=self.seed, store=run.store,
            executor=run.executor,
            progress=lambda done, total: run.progress(done, total, "worlds"),
        )  # fmt: skip
        return run.keep_result(found)


@dataclass(frozen=True)
class ControlTestWork:
    """The test of a policy.

    Attributes
    ----------
    policy : xarray.Dataset
        A `control_policy`.
    worlds : int
        Worlds of each arm.
    latency_s, missed : float or None
        Over the policy's.
    force_factor : float
        On sigma_F of the worlds.
    inputs : mapping of str to Path
        The files that were read, by their role.
    """

    policy: xr.Dataset
    worlds: int
    latency_s: float | None = None
    missed: float | None = None
    force_factor: float = 1.0
    inputs: Mapping[str, Path] = field(default_factory=dict)

    kind: ClassVar = "control_test"

    @property
    def study(self) -> Study:
        """The study of the policy."""
        from driftwalk.assembly.control.plan import stored_modes

        return stored_modes(self.policy).study

    @property
    def seeds(self) -> dict[str, int]:
        """The seed of the worlds."""
        return {"control": int(self.policy.attrs["seed"])}

    def checked(self) -> Self:
        """Refuse what is no policy."""
        from driftwalk.assembly.control.plan import stored_rules
        from driftwalk.assembly.control.trial import trial_setting

        stored_rules(self.policy)
        trial_setting(self.policy, self.worlds, self.latency_s, self.missed, self.force_factor)
        return self

    def specification(self) -> dict[str, Any]:
        """Return what determines the numbers."""
        names = tuple(sorted(str(name) for name in self.policy.data_vars))
        return {
            "policy_sha256": dataset_hash(self.policy, names),
            "policy": plain(dict(self.policy.attrs)),
            "worlds": self.worlds,
            "latency_s": self.latency_s,
            "missed": self.missed,
            "force_factor": self.force_factor,
        }

    def compute(self, run: Run) -> xr.Dataset:
        """Run the arms and keep what they reached."""
        from driftwalk.assembly import control_path, try_control

        found = try_control(
            self.policy, worlds=self.worlds, latency=self.latency_s, missed=self.missed,
            force_factor=self.force_factor, store=run.store, executor=run.executor,
            progress=lambda done, total: run.progress(done, total, "worlds"),
        )  # fmt: skip
        run.keep("path.nc", control_path(self.policy, found))
        return run.keep_result(found)
