"""Where is every block? From a camera or a video to poses, with reasons for what was left out."""

from driftwalk.track.types import Detection, Detector, Frame, FrameResult, PixelToWorld, Rejected

__all__ = [
    "Detection",
    "Detector",
    "Frame",
    "FrameResult",
    "PixelToWorld",
    "Rejected",
]
