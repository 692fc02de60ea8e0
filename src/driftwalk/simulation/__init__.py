"""What would this model do? Simulated trajectories of one block in a stirred tank."""

from driftwalk.simulation.camera import recorded_camera
from driftwalk.simulation.initial import Start, recorded_start
from driftwalk.simulation.run import simulate, simulate_like

__all__ = ["Start", "recorded_camera", "recorded_start", "simulate", "simulate_like"]
