"""What would this model do? Simulated trajectories of one block in a stirred tank."""

from driftwalk.simulation.initial import Start
from driftwalk.simulation.run import simulate

__all__ = ["Start", "simulate"]
