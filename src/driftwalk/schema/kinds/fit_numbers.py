"""The numbers of a fit: what its answer calls them, their symbols, and units for readers."""

from __future__ import annotations

from typing import Final

from driftwalk.schema.description import Number

_CORRECTED: Final = "corrected"
BLOCK_NUMBERS: Final = (
    Number("drag_coefficient", "1", "drag coefficient", "C_d"),
    Number("force_std", "N", "stochastic force", "σ_F"),
    Number("force_noise_intensity", "N2 s", "noise intensity", "σ_F²·τ", "N² s"),
    Number("tracking_noise", "m"),
    Number("force_lever", "m"),
    Number("orientation_noise", "rad", shown="°"),
)
"""Numbers of every fit; lever and noise of the orientation with the angle in the state."""
LAW_NUMBERS: Final = (
    Number("added_mass_share", label="added mass / mass",
           note="stated or assumed: no recording tells it"),
    Number("effective_drag_coefficient", label="C_d per effective mass",
           note="C_d over 1 + added mass / mass"),
    Number("effective_force_std", "N", "σ_F per effective mass", shown="mN",
           note="σ_F over 1 + added mass / mass"),
    Number("linear_drag", "kg s-1", shown="g/s", note="C_d is that of the quadratic part alone"),
    Number("drag_power", label="power of the drag", note="C_d holds at 3 cm/s"),
    Number("force_memory", "s", "memory of the force", shown="s",
           note="correlation time; σ_F is that of a white force, as strong at low frequencies"),
    Number("time_stamp_noise", "s", "jitter of the stamps", shown="ms",
           note="standard deviation of the time stamps; corrected"),
    Number("orientation_offset", "rad", shown="°", note="between marker and faces; corrected"),
    Number("marker_x", "m", "marker off by, x", shown="mm", note=_CORRECTED),
    Number("marker_y", "m", "marker off by, y", shown="mm", note=_CORRECTED),
    Number("flow_strength_change", "1", "change of the flow", shown="%",
           note="from the beginning to the end; corrected"),
    Number("pulse_amplitude", "1", "pulses of the flow", shown="%", note="amplitude; corrected"),
    Number("pulse_frequency", "Hz", "frequency of pulses", shown="Hz", note=_CORRECTED),
)  # fmt: skip
"""Numbers of a fit where the recording asks for it, or the user states it."""
WALL_NUMBERS: Final = (
    Number("wall_restitution", note="1: the wall takes no energy"),
    Number("wall_friction", note="0: the wall is smooth"),
)
PARAMETERS: Final = {one.name: one for one in (*BLOCK_NUMBERS, *LAW_NUMBERS)}
"""In the order in which a fit holds them."""
