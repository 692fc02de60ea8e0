"""What can be calibrated? Motion models: block, self-propelled bodies, any function or program."""

from driftwalk.motion.block import BlockModel
from driftwalk.motion.camera import observe_worlds
from driftwalk.motion.choose import feels_others, is_family_name, models, motion_model
from driftwalk.motion.external_program.program import ProgramModel
from driftwalk.motion.family.members import MEMBERS, Member
from driftwalk.motion.family.particle import ParticleModel
from driftwalk.motion.family.parts import PARTS, Part
from driftwalk.motion.function import FunctionModel, Scene
from driftwalk.motion.protocol import (
    Details,
    MotionModel,
    Scores,
    ScoresItself,
    WorldRandom,
    Worlds,
)
from driftwalk.motion.score import score_worlds
from driftwalk.motion.simulated import model_start, simulate_motion
from driftwalk.motion.values import estimated_values, known_values, models_knowing
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
    "ProgramModel",
    "Scene",
    "Scores",
    "ScoresItself",
    "WorldRandom",
    "Worlds",
    "estimated_values",
    "feels_others",
    "is_family_name",
    "known_values",
    "model_start",
    "models",
    "models_knowing",
    "motion_model",
    "observe_worlds",
    "score_worlds",
    "simulate_motion",
]
