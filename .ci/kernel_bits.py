"""Print what every kernel gives, to the last bit, on each instruction set that there is.

Two builds of driftwalk print the same, whatever compilers made them.
"""

from __future__ import annotations

import os
from hashlib import sha256

import numpy as np
import xarray as xr

import driftwalk as dw
from driftwalk import _core
from driftwalk.model import Study, apply_overrides

FLOATING = {
    "forces.added_mass_share": 0.5,
    "forces.pressure_gradient": True,
    "forces.linear_drag_kg_s": 5e-3,
    "forces.force_memory_s": 0.1,
}


def tell(name: str, dataset: xr.Dataset) -> None:
    """Print the attributes in full, of each variable the first number and a digest of all."""
    for key, value in sorted(dataset.attrs.items()):
        print(name, key, repr(value))
    for key, variable in sorted(dataset.data_vars.items()):
        values = np.ascontiguousarray(variable.values)
        digest = sha256(values.tobytes()).hexdigest() if values.dtype != object else "text"
        first = repr(values.flat[0]) if values.size else "nothing"
        print(name, key, values.dtype, values.shape, first, digest)


def main() -> None:
    """Fit half a minute of the bundled recording, simulate, compare, assemble."""
    recording = dw.tank30_recording().sel(time=slice(0.0, 30.0))
    study = apply_overrides(
        Study(), {"forces.force_interval_s": 0.016, "fit.spline_spacing_m": 0.03}
    )
    for instruction_set in _core.available_instruction_sets():
        os.environ["DRIFTWALK_INSTRUCTION_SET"] = instruction_set
        print(f"== {instruction_set}")
        fit = dw.fit_motion(recording, study)
        if not all(np.isfinite(fit[name]).all() for name in ("coefficient", "covariance")):
            raise SystemExit("kernel_bits: the fit holds numbers that are not finite")
        tell("fit", fit)
        flow = dw.fitted_flow(fit)
        path = dw.simulate(study, flow, sample_time=recording["time"].values, seed=1)
        tell("simulate", path)
        tell("compare", dw.compare(recording, path.isel(replicate=0)))
        for name, chosen in (("", study), (" floating", apply_overrides(study, FLOATING))):
            found = dw.assemble(chosen, flow, blocks=4, runs=20, duration=60.0, seed=1)
            tell(f"assemble{name}", found)


if __name__ == "__main__":
    main()
