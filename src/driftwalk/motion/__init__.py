"""What can be calibrated? Motion models: the block in a stirred tank, and any Python function."""

from driftwalk.motion.block import BlockModel
from driftwalk.motion.camera import observe_worlds
from driftwalk.motion.function import FunctionModel, Scene, motion_model
from driftwalk.motion.protocol import Details, MotionModel, Scores, ScoresItself, Worlds
from driftwalk.motion.random import WorldRandom
from driftwalk.motion.score import score_worlds
from driftwalk.schema import Parameter

__all__ = [
    "BlockModel",
    "Details",
    "FunctionModel",
    "MotionModel",
    "Parameter",
    "Scene",
    "Scores",
    "ScoresItself",
    "WorldRandom",
    "Worlds",
    "motion_model",
    "observe_worlds",
    "score_worlds",
]
