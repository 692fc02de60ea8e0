"""Tables of the forces between blocks for the native core, and what they say in numbers.

Magnets that are near act in each time step, distant ones in every few: r-RESPA, the impulses of
Tuckerman, Berne and Martyna (J. Chem. Phys. 97, 1992, 1990). A force of two faces, or
an energy, is parted by their distance r into a near and a distant share, S(r) and 1 - S(r); in the
middle of n steps the distant one acts n times as strong. Both shares have an energy of their own,
so that no energy is gained where they meet.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk import _core
from driftwalk.assembly.lattice.joined_faces import face_table
from driftwalk.assembly.pull.magnets import (
    MULTIPOLES,
    Energy,
    Multipoles,
    coaxial_force,
    fit_multipoles,
    magnet_energy,
)
from driftwalk.assembly.pull.measured import MeasuredAttraction, read_attraction
from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.model.interaction import Interaction, Magnet
from driftwalk.schema.check import build_dataset

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


class SteppingPolicy(NamedTuple):
    """How long distant magnets may wait, and which ones are distant."""

    every: int = 5
    """Time steps of a cycle; odd, so that a step is its middle; chosen by hand."""
    stiffness: float = 1.0
    """Most of 4 F' (n dt)² / m where forces begin to be distant. From 0.02 to 1, outcomes and times
    of 4000 runs of 4 blocks differ from those of one step by less than half of what chance makes
    of l1 and by 0.005 in KS, with the same random numbers."""
    fade: float = 1.5
    """Distance from which all is distant, over that up to which all is near. Measured: the energy
    of fixed magnets that fly apart is off by a fifth of what it is with 1.25."""


STEPPING: Final = SteppingPolicy()


class Stepping(NamedTuple):
    """Steps of the forces between faces, as the native core takes them; SI units."""

    every: int
    """Steps of a cycle; 1: all forces act in each step."""
    near_fading: float
    """Squared distance of two faces up to which they act in each step [m²]."""
    near_end: float
    """Squared distance from which they act once in a cycle [m²]."""


EACH_STEP: Final = Stepping(1, 0.0, 1.0)
"""Of forces that all act in each step."""


GRAVITY: Final = 9.81
"""[m/s²]"""
CELL_BITS: Final = 17
"""Bits of a float that the number of its cell leaves out: 64 cells in an octave of the squared
distance, within which a force of r⁻⁵ is straight to 3e-4."""


class PullPolicy(NamedTuple):
    """Where a table ends, and how steep it may be for the time step."""

    least_force_N: float = 1e-5
    """Force at the automatic cut-off; a hundredth of the drag at 6 cm/s of slip; chosen by hand."""
    taper: float = 0.8
    """Share of the cut-off beyond which the force is led to 0; chosen by hand."""
    stiffness: float = 0.5
    """Most of 4 F' dt² / m; measured: at 2 two blocks that turn about each other no longer keep an
    orbit, and at a quarter of that first contacts are within 1 % of those of a small step."""
    resistance: float = 0.25
    """Most of k dt / (gap m) of the resistance at close approach; stable below 1 in closed form, a
    quarter by hand."""
    angles: int = 36
    """Directions and angles of a table of oriented faces, a multiple of 4: measured on magnets of 5
    mm, 9 mm apart, forces and torques are within 0.2 % (rms) of the largest."""
    distance_step: float = 0.07
    """Step of the logarithm of its distance; measured in the same comparison."""


POLICY: Final = PullPolicy()


@dataclass(frozen=True, eq=False)
class RadialForce:
    """An attraction along the line between two points.

    Attributes
    ----------
    force : callable
        From distances [m] to the attraction [N], as it is measured.
    contact : float
        Distance at which two faces touch [m].
    capped_at : float
        Distance below which the force no longer grows [m].
    cutoff : float
        Distance beyond which it is 0 [m].
    """

    force: Callable[[Floats], Floats]
    contact: float
    capped_at: float
    cutoff: float

    def __call__(self, distance: npt.ArrayLike) -> Floats:
        """Return the attraction [N] that simulated blocks feel at distances [m]."""
        distance = np.asarray(distance, dtype=np.float64)
        inside = np.clip(distance, self.capped_at, self.cutoff)
        return np.asarray(self.force(inside) * _taper(distance, self.cutoff, self.contact))

    def cells(self) -> tuple[npt.NDArray[np.float64], int]:
        """Return force over distance [N/m] and its slope in cells, and the first cell's number."""
        # A clamp below the first cell, where two faces that touch never are.
        low = min(self.contact or 1e-3, self.cutoff) / 8.0
        first, last = cell_of(low**2), cell_of(self.cutoff**2) + 1
        edge = cell_start(np.arange(first, last + 1))
        value = self(np.sqrt(edge)) / np.sqrt(edge)
        value[-1] = 0.0
        slope = np.append(np.diff(value) / np.diff(edge), 0.0)
        return np.stack([value, slope], axis=1), first


def cell_of(squared: float) -> int:
    """Return the number of the cell of a squared distance [m²]."""
    return int(np.float32(squared).view(np.int32)) >> CELL_BITS


def cell_start(cell: npt.NDArray[np.int64]) -> Floats:
    """Return the least squared distance of cells [m²]."""
    return (cell.astype(np.int32) << CELL_BITS).view(np.float32).astype(np.float64)


def _taper(distance: Floats, cutoff: float, contact: float = 0.0) -> Floats:
    start = max(POLICY.taper, contact / cutoff)
    part = np.clip((distance / cutoff - start) / (1.0 - start), 0.0, 1.0)
    return np.asarray(1.0 - part**2 * (3.0 - 2.0 * part))


class PullTables(NamedTuple):
    """Tables of forces between blocks, as the native core takes them; SI units."""

    reach: float
    """Distance of two centres beyond which blocks feel nothing [m]."""
    lever: float
    """Of the points that attract, from the centre of the block [m]."""
    radial: dict[str, tuple[Floats, int]]
    """Cells of the forces of "centres", "resistance" and "faces", and the number of the first."""
    oriented: dict[str, Any] | None
    """Energy of two faces: its coefficients on (distance, direction, angle), and where they are."""
    multipoles: Multipoles | None
    """Energy of two faces in closed form, to which the one on (distance, ...) is added."""
    stepping: Stepping = EACH_STEP
    """Which forces of faces act in each step."""
    near_reach: float = 0.0
    """As `reach`, in the steps in which distant forces do not act [m]."""

    def native(self) -> _core.Pull:
        """Return the native core's form of the tables."""
        made = _core.Pull(
            reach=self.reach, lever=self.lever, pole=np.ones(4), like_poles_repel=False,
            near_reach=self.near_reach, **self.stepping._asdict(),
        )  # fmt: skip
        for what, (cells, first) in self.radial.items():
            made.set_radial(what, cells, first)
        if self.oriented is not None:
            made.set_oriented(**self.oriented)
        if self.multipoles is not None:
            made.set_multipoles(**self.multipoles._asdict())
        return made


@dataclass(frozen=True, eq=False)
class BlockPull:
    """Forces between the blocks of a study at a distance.

    Attributes
    ----------
    faces : RadialForce or None
        Attraction of two faces, opposite each other on one axis.
    lever : float
        Of the points that attract, from the centre of the block [m].
    centres : RadialForce or None
        Attraction of two centres, of the menisci.
    resistance : RadialForce or None
        Of the water between two centres, per closing speed and distance [N s/m²].
    tables : PullTables
        Their tables.
    native : driftwalk._core.Pull
        The native core's form of these.
    """

    faces: RadialForce | None
    lever: float
    centres: RadialForce | None
    resistance: RadialForce | None
    tables: PullTables
    native: _core.Pull


def table_of(study: Study) -> MeasuredAttraction | None:
    """Read the table of attraction of a study, up to its cut-off; None where it names none.

    Raises
    ------
    InputError
        When it cannot be read, or begins beyond the cut-off.
    """
    given = study.interaction
    if given.attraction is None:
        return None
    found = read_attraction(given.attraction)
    return found if given.cutoff_m == "auto" else found.up_to(given.cutoff_m)


def block_pull(study: Study, table: MeasuredAttraction | None = None) -> BlockPull | None:
    """Return the forces between the blocks of a study; None where they feel none.

    Parameters
    ----------
    study : Study
        Block, water, time step and interaction.
    table : MeasuredAttraction, optional
        Its table of attraction where that has been read: a run reads it once.

    Raises
    ------
    InputError
        When a magnet has no room in its block, discs have magnets, rectangles any interaction, no
        typed face has a pole, or a table cannot be read.

    Examples
    --------
    >>> import driftwalk as dw
    >>> pull = block_pull(dw.Study(interaction={"magnets": "5x5x2mm,1.3T"}))
    >>> float((1e3 * pull.faces.force(0.010 + pull.faces.contact)).round(1))
    35.3
    """
    if not study.interaction.is_on:
        return None
    if study.block.shape == "rectangle":
        raise InputError(
            "[interaction] has laws between squares and between discs, none between rectangles: "
            "leave the section out, or take squares"
        )
    mass = study.block.mass_kg * (1.0 + study.forces.added_mass_share)
    given, bonds = study.interaction, study.assembly
    measured = table or table_of(study)
    if given.magnet or measured:
        _require_poles(study)
    return _block_pull(
        given, study.block.side_m, study.block.is_round,
        mass, study.time_step_s, study.water.density_kg_m3, measured,
        loaded=bonds.bond_force_N > 0 or bonds.bond_strength_N > 0,
    )  # fmt: skip


@lru_cache(maxsize=32)
def _block_pull(
    given: Interaction,
    side: float,
    is_round: bool,
    mass: float,
    step: float,
    density: float,
    measured: MeasuredAttraction | None,
    *,
    loaded: bool,
) -> BlockPull:
    half, faces, centres, resistance = side / 2.0, None, None, None
    lever = half
    if is_round and (given.magnet or measured):
        raise InputError("discs have no faces: [interaction] magnets and attraction are of squares")
    steepest = POLICY.stiffness * mass / (4.0 * step**2)
    if magnet := given.magnet:
        _require_room(magnet, given.magnet_inset_m, side)
        lever = half - given.magnet_inset_m - magnet.thickness_m / 2.0
        faces = _limited(
            lambda r: coaxial_force(magnet, np.maximum(r, 1.001 * magnet.thickness_m)),
            2.0 * (half - lever), steepest, given.cutoff_m,
        )  # fmt: skip
    elif measured is not None:
        faces = _limited(measured.at_gap, 0.0, steepest, measured.longest_gap)
    if given.capillary == "on":
        centres = _meniscus(given, side, density)
    if given.approach_resistance_N_s > 0.0:
        resistance = _approach(given.approach_resistance_N_s, side, mass, step)
    oriented: Energy | None = None
    far: Multipoles | None = None
    end = 0.0 if faces is None else faces.cutoff
    if faces is not None and measured is not None and measured.is_oriented:
        oriented, end = measured.flat_below(faces.capped_at).energy, measured.farthest
    elif faces is not None and magnet is not None and given.poles == "fixed":
        oriented, far = _fixed_poles(magnet, faces)
    others = [force.cutoff for force in (centres, resistance) if force is not None]
    reach = max([0.0 if faces is None else end + 2.0 * lever, *others])
    radial: dict[str, RadialForce | None] = {"centres": centres, "resistance": resistance}
    tables = PullTables(reach, lever, {}, None, far)
    if faces is not None and oriented is None:
        radial["faces"] = faces
    elif faces is not None and oriented is not None:
        if far is not None and magnet is not None:
            end = min(end, max(MULTIPOLES.table * max(magnet[:3]), faces.capped_at / POLICY.taper))
        tables = tables._replace(
            oriented=_oriented(oriented, faces.contact, end, of_magnets=far is not None)
        )
    # A bond that breaks by its load would feel the impulse of a cycle as a force.
    if faces is not None and magnet is not None and not loaded:
        nearest = max(faces.capped_at, end if far is not None else 0.0)
        tables = _stepped(tables, faces, others, nearest=nearest, mass=mass, step=step)
    tables.radial.update(
        {what: force.cells() for what, force in radial.items() if force is not None}
    )
    return BlockPull(faces, lever, centres, resistance, tables, tables.native())


def _stepped(
    tables: PullTables, faces: RadialForce, others: list[float], *,
    nearest: float, mass: float, step: float,
) -> PullTables:  # fmt: skip
    """Part the force of two faces; where it is near up to its end, all acts in each step."""
    reach = np.geomspace(nearest, faces.cutoff, 2000)
    curved = np.abs(np.gradient(faces(reach), reach)) * 4.0 * (STEPPING.every * step) ** 2 / mass
    near = float(reach[np.flatnonzero(np.append(True, curved[:-1] > STEPPING.stiffness))[-1]])
    end = STEPPING.fade * near
    found = Stepping(STEPPING.every, near**2, end**2) if end < faces.cutoff else EACH_STEP
    near_reach = max([math.sqrt(found.near_end) + 2.0 * tables.lever, *others])
    return tables._replace(stepping=found, near_reach=near_reach)


def _require_poles(study: Study) -> None:
    """Refuse typed faces without a pole: no force of faces would act."""
    table = face_table(study.assembly)
    if table is not None and not table.pole.any():
        raise InputError(
            "[interaction] magnets and attraction act between the poles N and S of typed faces, "
            "and no face of these blocks has one: name faces N and S, or leave them out"
        )


def _require_room(magnet: Magnet, inset: float, side: float) -> None:
    """Refuse magnets that do not fit into the block, or into each other's way at its corners."""
    deep = inset + magnet.thickness_m
    if magnet.width_m >= side or deep >= side / 2.0 or magnet.width_m / 2.0 + deep > side / 2.0:
        raise InputError(
            f"[interaction] four magnets of {1e3 * magnet.width_m:g} mm by "
            f"{1e3 * magnet.thickness_m:g} mm, {1e3 * inset:g} mm below the faces, have no room in "
            f"a block of {1e3 * side:g} mm: take smaller ones"
        )


def _limited(
    force: Callable[[Floats], Floats],
    contact: float,
    steepest: float,
    cutoff: float | Literal["auto"],
) -> RadialForce:
    """Return a force that ends at its cut-off and is nowhere too steep for the time step.

    A cut-off that is a number counts from face to face.
    """
    reach = np.geomspace(max(contact, 1e-4), 1.0, 4000)
    if cutoff == "auto":
        felt = reach[np.abs(force(reach)) > POLICY.least_force_N]
        end = float(felt[-1]) if felt.size else contact
    else:
        end = contact + cutoff
    if end <= contact:
        raise InputError(
            "[interaction] two faces that touch attract each other with less than "
            f"{1e3 * POLICY.least_force_N:g} mN: give stronger magnets, or cutoff_m in numbers"
        )
    # The end itself is no slope of the force: the taper leads it to 0.
    reach = reach[reach < end] if end > reach[2] else np.linspace(end / 2.0, end, 9)[:-1]
    steep = reach[np.abs(np.gradient(force(reach), reach)) > steepest]
    capped = float(steep[-1]) if steep.size else 0.0
    return RadialForce(force, contact, min(max(capped, contact / 2.0), end), end)


def _meniscus(given: Interaction, side: float, density: float) -> RadialForce:
    """Return the attraction of two upright cylinders by their menisci.

    The deformation of one cylinder of radius R is H K0(q r) / K0(q R), with 1/q the capillary
    length; the force on another one is 2 π γ q H² K1(q r) / K0(q R)².
    """
    from scipy.special import k0, k1

    per_length = math.sqrt(density * GRAVITY / given.surface_tension_N_m)
    strength = 2.0 * math.pi * given.surface_tension_N_m * per_length * given.meniscus_height_m**2
    strength /= float(k0(per_length * side / 2.0)) ** 2
    return RadialForce(
        lambda r: np.asarray(strength * k1(per_length * r)), side, 0.7 * side,
        side + (12.0 / per_length if given.cutoff_m == "auto" else given.cutoff_m),
    )  # fmt: skip


def _approach(factor: float, side: float, mass: float, step: float) -> RadialForce:
    """Return resistance per closing speed and distance [N s/m²] between the inscribed circles."""
    least = factor * step / (POLICY.resistance * mass)
    return RadialForce(
        lambda r: factor / (np.maximum(r - side, least) * r), side, 0.5 * side, 2.0 * side
    )


def _fixed_poles(magnet: Magnet, faces: RadialForce) -> tuple[Energy, Multipoles]:
    """Return the energy of two faces with fixed magnets, as flat as the time step needs it.

    In two parts: what is missing near by in the closed form, and this.
    """
    nearest = max(faces.capped_at, 1.05 * magnet.thickness_m)

    def energy(x: Floats, y: Floats, angle: Floats) -> Floats:
        r = np.hypot(x, y)
        sizes = float(r.min()) / max(magnet[:3])
        nodes = next(n for n, least in ((2, 6.0), (4, 2.5), (8, 0.0)) if sizes >= least)
        if r.min() >= nearest:
            return magnet_energy(magnet, x, y, angle, nodes=nodes)
        # Inside, the force along the line stays what it is at the edge.
        edge, step = nearest / np.maximum(r, 1e-12), 1e-3 * nearest
        further = edge * (1.0 + step / nearest)
        here = magnet_energy(magnet, x * edge, y * edge, angle, nodes=nodes)
        beyond = magnet_energy(magnet, x * further, y * further, angle, nodes=nodes)
        return np.asarray(here - (beyond - here) / step * (nearest - r))

    end = faces.cutoff
    far = fit_multipoles(
        lambda *at: magnet_energy(magnet, *at, nodes=4), max(magnet[:3]),
        max(POLICY.taper * end, faces.contact), end,
    )  # fmt: skip
    return lambda x, y, a: energy(x, y, a) * far.fade(x, y) - far.energy(x, y, a), far


def _oriented(energy: Energy, contact: float, end: float, *, of_magnets: bool) -> dict[str, Any]:
    """Return the energy of two faces on (log distance, direction, angle), and where that is."""
    from scipy.ndimage import spline_filter1d

    n, step = POLICY.angles, POLICY.distance_step
    low = max(contact / 2.0, 5e-4)
    # A table is 0 from its end on; the energy of magnets is led to 0 before it.
    count = math.ceil(math.log(max(end / low, 2.0)) / step) + (0 if of_magnets else 2)
    log_distance = math.log(low) + step * np.arange(count)
    r = np.exp(log_distance)
    turn = 2.0 * np.pi * np.arange(n) / n
    grid = np.meshgrid(r, turn[: n // 4 + 1] if of_magnets else turn, turn, indexing="ij")
    found = np.concatenate(
        [energy(d * np.cos(a), d * np.sin(a), b) for d, a, b in zip(*grid, strict=True)]
    ).reshape(grid[0].shape)
    if of_magnets:  # they have the same energy in a mirror, and before and behind each other
        mirrored = found[:, n // 4 - 1 : 0 : -1, -np.arange(n)]
        found = np.concatenate([found, mirrored] * 2, axis=1)
        found *= _taper(r, r[-1])[:, None, None]
    spline = spline_filter1d(found, order=2, axis=0, mode="mirror")
    for axis in (1, 2):
        spline = spline_filter1d(spline, order=2, axis=axis, mode="grid-wrap")
    return {
        "coefficient": np.ascontiguousarray(spline),
        "first": float(log_distance[0]),
        "per_step": 1.0 / step,
        "low": low,
        "high": float(r[-1]),
    }


SHOWN_GAP_M: Final = 0.010
"""Gap at which the force is stated: an easy one to set with a spacer; chosen by hand."""
CURVE_POINTS: Final = 400
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
    gap = np.append(0.0, np.geomspace(1e-4, max(reach, 2e-4), CURVE_POINTS))

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
