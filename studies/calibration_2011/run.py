"""Repeat the paper's sensitivity analysis of self-assembly, and hold it against what it says.

    python studies/calibration_2011/run.py OUT [OPTIONS]

Runs ``driftwalk sensitivity`` with `study.toml` into the folder OUT, in the flow of the bundled
recording unless OPTIONS say another (``--flow FILE``) or begin with the run directory of a
calibration. Other options are the command's, such as ``--hidden-face-drag full``; killed, it
continues, and a finished run is only read. Then it prints a table: what the paper found, and what
came out here.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib.resources import as_file, files
from pathlib import Path

import numpy as np
import xarray as xr

import driftwalk as dw
from driftwalk.cli.main import main as driftwalk

STUDY = Path(__file__).with_name("study.toml")
NAMES = ("reference", "sensitivity", "components")
DIMS = ("drag_coefficient", "force_std")
PAPER_PAIRWISE_L1 = 0.065
SMALL = {"drag_coefficient": 0.1, "force_std": 0.1e-3}
"""What counts as a small value of a parameter: the lowest three of the map."""
LARGE_FORCE = 1.2e-3
"""What counts as a large force [N]."""


def main(out: str, *options: str) -> int:
    """Run the command where it has not been run, and print the table."""
    if not (Path(out) / "manifest.json").exists():
        code = run(Path(out), list(options))
        if code:
            return code
    print("\n| | the paper | here |\n|---|---|---|")
    for row in rows(*(read(Path(out) / f"{name}.nc") for name in NAMES)):
        print("| " + " | ".join(row) + " |")
    return 0


def run(out: Path, options: list[str]) -> int:
    """Run the command, and return its exit code."""
    words = ["--study", str(STUDY), "--out", str(out)]
    if "--flow" in options or (options and not options[0].startswith("-")):
        return driftwalk(["sensitivity", *options, *words])
    with as_file(files("driftwalk.datasets") / "tank30_ode_a" / "flow_true.csv") as flow:
        return driftwalk(["sensitivity", "--flow", str(flow), *options, *words])


def read(path: Path) -> xr.Dataset:
    """Return a dataset of the run."""
    with xr.open_dataset(path, engine="h5netcdf") as dataset:
        return dataset.load()


def rows(
    reference: xr.Dataset, found: xr.Dataset, components: xr.Dataset
) -> Iterator[tuple[str, str, str]]:
    """Give the rows of the table: the question, the paper's answer, ours."""
    facts, floor = reference.attrs, found.attrs["noise_floor_95"]
    names = [str(name) for name in reference["class"].values]
    order = np.argsort(-reference["proportion"].values, kind="stable")
    common = ", ".join(f"{names[i]} {float(reference['proportion'][i]):.1%}" for i in order[:5])
    yield "classes that came", "10 of 10", f"{int((found['count'] > 0).any(DIMS).sum())} of 10"
    yield "reference (Fig. 9), most common classes", "", common
    pairwise, expected = facts["mean_pairwise_l1"], facts["expected_pairwise_l1"]
    yield (
        "mean l1 of two of its realisations",
        f"{PAPER_PAIRWISE_L1}",
        f"{pairwise:.3f}; by multinomial sampling {expected:.3f}",
    )
    distance = found["l1_distance"]
    yield (
        "distances of the map (Fig. 11)",
        '"much larger than the fluctuations" of the reference',
        f"{float(distance.min()):.3f} to {float(distance.max()):.3f}, median "
        f"{float(distance.median()):.3f}; {float((distance > floor).mean()):.0%} above the 95 % "
        f"noise floor of {floor:.3f}",
    )
    small = (found["drag_coefficient"] <= SMALL["drag_coefficient"]) | (
        found["force_std"] <= SMALL["force_std"]
    )
    yield (
        "where distances are largest",
        '"for small values of either parameters"',
        f"median {float(distance.where(small).median()):.2f} where C_d <= 0.1 or σ_F <= 0.1 mN, "
        f"{float(distance.where(~small).median()):.2f} elsewhere",
    )
    low = distance.stack(setting=DIMS)
    low = low.isel(setting=int(low.values.argmin()))
    large = float(distance.where(found["force_std"] >= LARGE_FORCE).min())
    yield (
        "where the smallest distance is",
        '"very large stochastic forces", not near the reference',
        f"C_d = {float(low['drag_coefficient']):.2f}, σ_F = {1e3 * float(low['force_std']):.2f} mN "
        f"({float(low):.3f}); from 1.2 mN on {large:.3f}",
    )
    share = components["explained_variance_ratio"].values
    yield (
        "principal components (Fig. 10)",
        "two are shown",
        f"{share[0]:.0%} and {share[1]:.0%} of the variance",
    )
    aligned = dw.assembly.disconnected_alignment(components)
    yield (
        "component 1",
        '"aligned with the physically disconnected" classes',
        f"{aligned.loading_share:.0%} of its squared loadings are on them; correlation "
        f"{aligned.complete_correlation:.2f} with the share of complete runs",
    )
    whole = float((found["complete"] > 0.99).mean())
    yield (
        "disconnected outcomes",
        '"never observed in most scenarios"',
        f"less than 1 % of the runs in {whole:.0%} of the settings",
    )


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
