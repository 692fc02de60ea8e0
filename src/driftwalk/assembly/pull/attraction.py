"""The force between two blocks in numbers that a balance measures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from driftwalk.assembly.pull.tables import BlockPull, block_pull
from driftwalk.core.arrays import Floats
from driftwalk.schema.check import build_dataset

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study

SHOWN_GAP_M: Final = 0.010
"""Gap at which the force is stated: an easy one to set with a spacer."""
POINTS: Final = 400
"""Gaps of the curve, smooth to the eye; chosen by hand."""


def attraction(study: Study) -> xr.Dataset | None:
    """Return the force between two blocks, face to face, against the gap between them.

    Parameters
    ----------
    study : Study
        With its [interaction].

    Returns
    -------
    xarray.Dataset or None
        Kind "attraction": ``force`` and ``simulated_force`` [N], which the time step may cap, and
        ``energy`` [J], on ``gap`` [m]; of magnets or a table, and menisci, together. None where
        blocks feel nothing of each other, or only the resistance of the water between them.

    Raises
    ------
    InputError
        As `assemble`.

    Examples
    --------
    >>> import driftwalk as dw
    >>> found = attraction(dw.Study(interaction={"magnets": "5x5x2mm,1.2T"}))
    >>> round(1e3 * found.attrs["force_at_contact_N"]), round(1e6 * found.attrs["binding_energy_J"])
    (1436, 3075)
    """
    pull = block_pull(study)
    if pull is None or (pull.faces is None and pull.centres is None):
        return None
    forces = [force for force in (pull.faces, pull.centres) if force is not None]
    reach = max(force.cutoff - force.contact for force in forces)
    gap = np.append(0.0, np.geomspace(1e-4, max(reach, 2e-4), POINTS))

    def felt_at(gap: Floats) -> Floats:
        return np.asarray(sum(force.force(gap + force.contact) for force in forces))

    felt = felt_at(gap)
    simulated = np.sum([force(gap + force.contact) for force in forces], axis=0)
    steps = (felt[1:] + felt[:-1]) / 2.0 * np.diff(gap)
    energy = -np.append(np.cumsum(steps[::-1])[::-1], 0.0)
    capped = max(0.0, *(force.capped_at - force.contact for force in forces))
    return build_dataset(
        "attraction",
        {
            "force": ("gap", felt),
            "simulated_force": ("gap", simulated),
            "energy": ("gap", energy),
        },
        {"gap": ("gap", gap)},
        {
            "between": _words(study, pull),
            "force_at_contact_N": float(felt[0]),
            "force_at_10mm_N": float(felt_at(np.array([SHOWN_GAP_M]))[0]),
            "binding_energy_J": float(-energy[0]),
            "most_simulated_N": float(simulated.max()),
            "capped_below_m": capped,
            "study": study.to_toml(),
        },
    )


def _words(study: Study, pull: BlockPull) -> str:
    """Return what acts between the blocks."""
    given, is_typed = study.interaction, study.assembly.typed_faces is not None
    parts = []
    if given.magnet is not None:
        seats = "poles given by the faces" if is_typed else "turning in their seats"
        if given.poles == "fixed":
            seats = "fixed, poles given by the faces" if is_typed else "fixed"
        inset = f"{1e3 * given.magnet_inset_m:g} mm below the faces"
        parts.append(f"magnets {given.magnets}, {seats}, {inset}")
    if given.attraction is not None:
        parts.append(f"the table {given.attraction}")
    if pull.centres is not None:
        parts.append(f"menisci {1e3 * given.meniscus_height_m:g} mm high")
    return "; ".join(parts)
