"""Outcomes of four blocks whose bonds break, against permanent bonds: python bonds.py [RUNS].

The bundled flow, C_d 0.45, σ_F 0.55 mN redrawn every 10 ms, 300 s: the conditions of the study of
interactions. A row has the l1 distance to runs with permanent bonds (with what chance alone makes
at 95 %), the share of complete runs, and those of the classes T, L, O and of all apart at the end;
then the share of time in them and whether it is steady.
"""

from __future__ import annotations

import sys

import driftwalk as dw

RATES = (0.001, 0.01, 0.1)
SHOWN = ("T", "L", "O", "1+1+1+1")


def outcomes(rate: float, *, runs: int, **rules: float) -> tuple[object, object]:
    """Return the distribution at the end, and the steady state where bonds break."""
    study = dw.Study(
        forces={"drag_coefficient": 0.45, "force_std_N": 0.55e-3},
        assembly={"bond_rate_per_s": rate, **rules},
    )
    found = dw.assemble(study, dw.tank30_flow(), blocks=4, runs=runs, duration=300.0)
    return dw.outcome_distribution(found), dw.steady_state(found) if rate else None


def main(runs: str = "500") -> None:
    """Print a row for each rate."""
    stock, _ = outcomes(0.0, runs=int(runs))
    pooled = dict(zip(stock["class"].values, stock["proportion"].values, strict=True))
    floor = dw.l1_noise_floor(pooled, int(runs), int(runs))
    print(f"by chance: l1 {floor.mean:.3f}, 95 % {floor.quantile:.3f}")
    print("rate [1/s]  l1     complete  T     L     O     apart  share of time of the same")
    for rate in (0.0, *RATES):
        found, steady = outcomes(rate, runs=int(runs))
        end = [float(found["proportion"].sel({"class": name})) for name in SHOWN]
        row = f"{rate:<10g}  {dw.l1_distance(stock, found):.3f}  {found.attrs['complete']:.3f}     "
        row += "  ".join(f"{share:.3f}" for share in end)
        if steady is not None:
            time = [float(steady["time_share"].sel({"class": name})) for name in SHOWN]
            row += "  " + " ".join(f"{share:.3f}" for share in time)
            row += f"  steady: {steady.attrs['steady']} (p = {steady.attrs['steady_p']:.2g})"
        print(row)


if __name__ == "__main__":
    main(*sys.argv[1:])
