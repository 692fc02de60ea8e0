"""The numbers of every kind of dataset, as three sums for each variable.

    python tests/reference/pinned_numbers.py          # after a change that is meant to move numbers
    python tests/reference/pinned_numbers.py --exact  # which sums differ in their last bit

`test_pinned_numbers.py` compares them with the stored ones to the tolerance that processors and
linear algebra libraries need. A refactoring changes no bit on one machine. Names and texts are not
compared, so a renamed variable counts as missing.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import xarray as xr

if __name__ == "__main__":
    sys.path[:0] = [str(Path(__file__).parents[1] / name) for name in ("helpers", "reference")]

from every_kind import FORMS, every_kind

STORED = Path(__file__).parents[1] / "data" / "pinned_numbers.json"


def sums_of(dataset: xr.Dataset) -> dict[str, list[float]]:
    """Return what is finite, the mean size, and a mean with changing signs, of each variable."""
    numbers = {str(name): np.asarray(dataset[name].values) for name in dataset.variables}
    numbers |= {f"attribute {name}": np.asarray(value) for name, value in dataset.attrs.items()}
    # A fit_time is seconds on a clock.
    return {
        name: _sums(array.astype(np.float64).ravel())
        for name, array in sorted(numbers.items())
        if array.dtype.kind in "biuf" and name != "fit_time"
    }


def _sums(values: np.ndarray) -> list[float]:
    known = np.isfinite(values)
    if not known.any():
        return [0.0, 0.0, 0.0]
    # Frequencies without a common period: exchanged and shifted values are seen.
    weight = np.cos(np.sqrt(2.0) * np.arange(values.size) ** 2)[known]
    found = values[known]
    return [
        float(known.sum()), float(np.abs(found).mean()), float((weight * found).mean())
    ]  # fmt: skip


def text_of(found: dict[str, dict[str, list[float]]]) -> str:
    """Return JSON with a line for each variable, so that a change of one is a line of the diff."""
    forms = []
    for form, sums in found.items():
        lines = ",\n".join(f"  {json.dumps(name)}: {json.dumps(one)}" for name, one in sums.items())
        forms.append(f" {json.dumps(form)}: {{\n{lines}\n }}")
    return "{\n" + ",\n".join(forms) + "\n}\n"


def main() -> None:
    found = {form: sums_of(every_kind(form)) for form in FORMS}
    if "--exact" not in sys.argv:
        STORED.write_text(text_of(found), encoding="utf-8")
        return
    before = json.loads(STORED.read_text(encoding="utf-8"))
    for form in sorted({*found, *before}):
        mine, stored = found.get(form, {}), before.get(form, {})
        for name in sorted({*mine, *stored}):
            if mine.get(name) != stored.get(name):
                print(f"{form}: {name}: {stored.get(name)}, now {mine.get(name)}")


if __name__ == "__main__":
    main()
