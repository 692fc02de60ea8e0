"""What can be calibrated? Motion models: block, self-propelled bodies, any Python function."""

from driftwalk.motion.block import BlockModel
from driftwalk.motion.camera import observe_worlds
from driftwalk.motion.choose import motion_model
from driftwalk.motion.family import MEMBERS, PARTS, Member, Part, ParticleModel, models
from driftwalk.motion.function import FunctionModel, Scene
from driftwalk.motion.protocol import Details, MotionModel, Scores, ScoresItself, Worlds
from driftwalk.motion.random import WorldRandom
from driftwalk.motion.score import score_worlds
from driftwalk.schema import Parameter

__all__ = [
    "MEMBERS",
    "PARTS",
    "BlockModel",
    "Details",
    "FunctionModel",
    "Member",
    "MotionModel",
    "Parameter",
    "Part",
    "ParticleModel",
    "Scene",
    "Scores",
    "ScoresItself",
    "WorldRandom",
    "Worlds",
    "models",
    "motion_model",
    "observe_worlds",
    "score_worlds",
]
