"""Digests of the numbers that every kind of dataset holds, to compare two versions of driftwalk.

    python tests/architecture/number_digests.py digests.json
    python tests/architecture/number_digests.py new.json --against digests.json

A refactoring changes none of them. Run it before and after, on one machine: the last digits of a
fit depend on its linear algebra library. Names and texts are not compared, so a renamed variable
counts as missing, and its numbers have to be found again under the new name.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).parents[1] / name) for name in ("helpers", "reference")]

from every_kind import FORMS, every_kind  # noqa: E402


def digest(values: np.ndarray) -> str:
    """Return the first digits of the hash of an array's type, shape and bytes."""
    text = f"{values.dtype.str}{values.shape}".encode()
    return hashlib.sha256(text + np.ascontiguousarray(values).tobytes()).hexdigest()[:16]


def digests(form: str) -> dict[str, str]:
    """Return a digest for each numeric variable and attribute of a form."""
    dataset = every_kind(form)
    numbers = {str(name): np.asarray(dataset[name].values) for name in dataset.variables}
    numbers |= {f"attribute {name}": np.asarray(value) for name, value in dataset.attrs.items()}
    # A fit_time is seconds on a clock.
    return {
        name: digest(array)
        for name, array in numbers.items()
        if array.dtype.kind in "biuf" and name != "fit_time"
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--against", type=Path)
    words = parser.parse_args()
    found = {form: digests(form) for form in FORMS}
    words.out.write_text(json.dumps(found, indent=1), encoding="utf-8")
    if words.against is None:
        return 0
    before = json.loads(words.against.read_text(encoding="utf-8"))
    changed = [
        f"{form}: {name}: " + ("missing" if name not in found.get(form, {}) else "changed")
        for form, names in before.items()
        for name, value in names.items()
        if found.get(form, {}).get(name) != value
    ]
    print("\n".join(changed) or f"the same numbers in {len(before)} datasets")
    return 1 if changed else 0


if __name__ == "__main__":
    sys.exit(main())
