"""What forces between blocks and bonds that break change: python rows.py [RUNS].

Four blocks for 300 s in the flow of the bundled recording, C_d = 0.45, σ_F = 0.55 mN every 10 ms.
Prints one row per variant: the l1 distance of its outcome distribution to that of blocks that feel
nothing of each other (Eq. 5), the share of complete runs, the median time of first contact, and the
shares of four classes at the end. Where bonds break, the shares of time in them follow, and whether
these are steady. Further rows are further entries of ROWS.
"""

from __future__ import annotations

import sys
from typing import Any, Final

import driftwalk as dw

ROWS: Final[dict[str, dict[str, Any]]] = {
    "nothing": {},
    "magnets 3×3×1 mm, 1.2 T": {"interaction.magnets": "3x3x1mm,1.2T"},
    "magnets 3×3×1 mm, 1.2 T, fixed": {
        "interaction.magnets": "3x3x1mm,1.2T", "interaction.poles": "fixed",
    },
    "magnets 5×5×2 mm, 1.2 T": {"interaction.magnets": "5x5x2mm,1.2T"},
    "menisci 1 mm high": {"interaction.capillary": "on"},
    "resistance 0.1 mN s": {"interaction.approach_resistance_N_s": 1e-4},
    "bonds break at 0.001 /s": {"assembly.bond_rate_per_s": 0.001},
    "bonds break at 0.01 /s": {"assembly.bond_rate_per_s": 0.01},
    "bonds break at 0.1 /s": {"assembly.bond_rate_per_s": 0.1},
}  # fmt: skip
"""Variants by what is set of the study."""
CLASSES: Final = ("T", "L", "O", "1+1+1+1")


def print_row(name: str, changes: dict[str, Any], *, runs: int, stock: Any = None) -> Any:
    """Simulate a variant, print its row and return its outcome distribution."""
    study = dw.apply_overrides(dw.Study(), changes)
    # Another seed than the stock's: the distance by chance is that of independent runs.
    found = dw.assemble(study, dw.tank30_flow(), runs=runs, seed=1 if stock is None else 2)
    outcomes, times = dw.outcome_distribution(found), dw.class_times(found)
    share = dict(zip(outcomes["class"].values, outcomes["proportion"].values.tolist(), strict=True))
    apart = "–" if stock is None else f"{dw.l1_distance(stock, outcomes):.3f}"
    print(
        f"| {name} | {apart} | {outcomes.attrs['complete']:.3f} "
        f"| {times.attrs['first_contact_median_s']:.2f} s "
        f"| {' '.join(f'{share.get(one, 0.0):.3f}' for one in CLASSES)} | {_steady(found)} |",
        flush=True,
    )
    return outcomes


def _steady(found: Any) -> str:
    """Return the shares of time in the classes where bonds break, and whether they are steady."""
    if "bond_rate_per_s" not in found.attrs:
        return ""
    steady = dw.steady_state(found)
    time = [float(steady["time_share"].sel({"class": name})) for name in CLASSES]
    shares = " ".join(f"{share:.3f}" for share in time)
    return f"{shares}, steady: {steady.attrs['steady']} (p = {steady.attrs['steady_p']:.2g})"


def main() -> None:
    """Print all rows."""
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 500
    print("| variant | l1 | complete | first contact | T L O all apart | of the time |")
    print("|---|---|---|---|---|---|")
    stock = None
    for name, changes in ROWS.items():
        outcomes = print_row(name, changes, runs=runs, stock=stock)
        stock = outcomes if stock is None else stock
    share = dict(zip(stock["class"].values, stock["proportion"].values.tolist(), strict=True))
    floor = dw.l1_noise_floor(share, runs, runs)
    print(f"\nl1 by chance {floor.mean:.3f}, 95 %: {floor.quantile:.3f}")


if __name__ == "__main__":
    main()
