"""Drag, the stochastic force and the flow: what the water does to the block."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from driftwalk.model.section import Quantity, Section

DragCoefficient = Annotated[float, Quantity("1", ge=0, le=100)]
ForceStd = Annotated[float, Quantity("N", ge=0, le=10)]


class Forces(Section):
    """Drag coefficient C_d and stochastic force F ~ N(0, σ_F² I₂), redrawn every interval.

    That is the paper's law. The keys after the force interval add to it what a floating body feels;
    with their defaults they add nothing.

    Examples
    --------
    >>> round(Forces().force_noise_intensity_N2_s, 12)
    3.025e-09
    """

    section_name: ClassVar[str] = "forces"

    drag_coefficient: DragCoefficient = 0.45
    """Drag coefficient C_d of a side face."""
    force_std_N: ForceStd = 0.55e-3
    """Standard deviation of the stochastic force.

    Standard deviation sigma_F of each horizontal component of the stochastic force on the centre of
    mass.
    """
    force_interval_s: Annotated[float, Quantity("s", gt=0, le=10)] = 0.010
    """Interval at which the stochastic force is redrawn. It is part of the model: a recording
    determines only sigma_F^2 * force_interval, so always state the two together."""

    force_memory_s: Annotated[float, Quantity("s", ge=0, le=1e3)] = 0.0
    """Correlation time of the stochastic force.

    Correlation time T of the stochastic force, 0 for none. With T > 0 a force keeps the share k =
    exp(-force_interval / T) of the one before it, and 1 - k is new, with standard deviation
    sigma_F: the noise intensity is still sigma_F^2 * force_interval.
    """
    stirring_length_m: Annotated[float, Quantity("m", ge=0, le=1e3)] = 0.0
    """Distance over which blocks share the stochastic force.

    Length L of the stochastic force in space: two blocks at a distance r feel forces with the
    correlation exp(-r^2 / 2 L^2). 0: each block has a force of its own. One block alone feels the
    same with every L.
    """
    stirring: Literal["free", "incompressible"] = "free"
    """Force field of the stirring: "free", or "incompressible" (without divergence)."""
    force_lever_m: Annotated[float | None, Quantity("m", ge=0, le=10)] = Field(
        default=None, examples=[0.01]
    )
    """Lever with which the stochastic force turns the body.

    Lever of the stochastic force, rms: every interval the body feels a torque too, with the
    standard deviation sigma_F times the lever. Not stated, it is 0 for one block, and for glued
    blocks what forces on each of them make.
    """
    linear_drag_kg_s: Annotated[float, Quantity("kg/s", ge=0, le=1e4)] = 0.0
    """Drag of the block linear in the slip.

    Drag k linear in the slip, in addition to the quadratic one: each of the 4 N strips, windward or
    not, feels k / (4 N) times the velocity of the water relative to it.
    """
    drag_power: Annotated[float, Quantity("1", ge=0.5, le=3.5)] = 2.0
    """Power p of the speed in the drag law.

    Power p of the speed in the drag of windward strips: the force is (|w| / drag_speed)^(p - 2)
    times the force of the quadratic law, with |w| the speed of the water relative to the strip.
    """
    drag_speed_m_s: Annotated[float, Quantity("m/s", gt=0, le=1e3)] = 0.03
    """Speed at which C_d holds, where the power of the drag is not 2.

    Speed of the water past a strip at which C_d is the drag coefficient, with any power of the
    drag; with the power 2 it has no effect.
    """
    added_mass_share: Annotated[float, Quantity("1", ge=0, le=5)] = 0.0
    """Added mass as a share of the block's mass.

    Added mass m_a of the water that moves along, as a share of the block's mass; the moment of
    inertia grows by the same share.
    """
    pressure_gradient: bool = False
    """Whether water that accelerates pushes the block.

    Whether the pressure that accelerates the water, Du/Dt, pushes the block too, by (m + m_a)
    Du/Dt: a floating block displaces its own mass of water.
    """

    @property
    def force_noise_intensity_N2_s(self) -> float:
        """Noise intensity σ_F² · force interval [N² s], all that a recording can determine."""
        return self.force_std_N**2 * self.force_interval_s


class Flow(Section):
    """Extraction of the flow field from a recording (Eq. 4 of the paper), and its course."""

    section_name: ClassVar[str] = "flow"

    cells: Annotated[int, Quantity("1", ge=2, le=2000, whole=True)] = 50
    """Cells across the longer side of the tank."""
    cell_size_m: Annotated[float | None, Quantity("m", gt=0, le=10)] = Field(
        default=None, examples=[0.006]
    )
    """Side of a cell, instead of `cells`."""
    smoothing_window_s: Annotated[float, Quantity("s", gt=0, le=1e3)] = 0.7
    """Window of the local quadratic fit that gives velocity and acceleration."""
    flow_drag_coefficient: Annotated[float, Quantity("1", gt=0, le=100)] = 1.05
    """Drag coefficient C_x of the inertia correction (Eq. 4)."""
    min_count: Annotated[int, Quantity("1", ge=1, le=1_000_000, whole=True)] = 1
    """Smallest number of samples in a measured cell."""
    inertia: Literal["corrected", "none"] = "corrected"
    """Correction for the body's inertia.

    "corrected" adds the inertia term of Eq. 4; "none" leaves it out.
    """
    repeat: Literal["none", "loop", "mirror", "hold"] = "none"
    """How a flow series goes on after its last frame.

    How a flow that changes in time goes on after its last frame: "loop" begins again, "mirror" runs
    backwards and forwards in turns, "hold" stands still; with "none" longer simulations are
    refused.
    """
    start: Literal["random", "first"] = "random"
    """Where in a flow series a run begins.

    Moment of a flow that changes in time at which a run begins: "random", one for each run, or
    "first", the first frame for all. With a recording its clock is kept.
    """
