"""Which bodies move by themselves? The family of self-propelled motion models."""

from driftwalk.motion.family.members import MEMBERS, Member
from driftwalk.motion.family.particle import ParticleModel
from driftwalk.motion.family.parts import PARTS, Part

__all__ = ["MEMBERS", "PARTS", "Member", "Part", "ParticleModel"]
