"""Bonds that break, in the kernel and in its NumPy twin: same random numbers, same events."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from test_assembly_twin import RULES, apart, drain, native_row, placed, rectangles, world_key
from twin.assembly import assemble_reference
from twin_assembly import study

import driftwalk as dw

# Within that many steps no rounding has grown to the tolerance, and what parts meets again.
TOLERANCE = 1e-7


@pytest.mark.slow
@pytest.mark.parametrize(
    ("make", "seed", "loops"),
    [(study, 1, False), (study, 4, False), (study, 11, True), (rectangles, 1, False)],
)
def test_kernel_and_twin_break_the_same_bonds(
    make: Callable[..., dw.Study], seed: int, loops: bool
) -> None:
    model = make(0.2)
    flow = drain(model, inflow=1.0, spin=1.5)
    settings: dict[str, Any] = {
        **RULES, "latching": "collision", "force_std": 1e-3, "steps": 260, "key": world_key(seed),
    }  # fmt: skip
    settings["start"] = placed(model, flow, 6, world_key(seed))
    native = native_row(model, flow, **settings, bonds=(1.0, 0.0, 0.0, 1.05), event_rows=99)
    twin = assemble_reference(model, flow, **settings, bond_rate=1.0, relatch_clearance=1.05)
    count = twin["event_count"]
    assert native["event_count"] == count
    # Joinings and partings, and of one seed a loop that closes and opens.
    assert set(twin["event_kind"].tolist()) == ({0, 1, 2, 3} if loops else {0, 1})
    for name in ("event_step", "event_kind", "event_block", "event_face"):
        np.testing.assert_array_equal(native[name][:count], twin[name][:count], err_msg=name)
    for name in ("first_contact_step", "end_step", "cell", "quarter", "assembly"):
        np.testing.assert_array_equal(native[name], twin[name], err_msg=name)
    assert apart(native, twin) < TOLERANCE
