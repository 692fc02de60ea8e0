"""Which parameters fit a recording, and how well are they known?"""

from driftwalk.calibrate.run import calibrate

__all__ = ["calibrate"]
