"""Where is every block? From a camera or a video to poses, with reasons for what was left out."""

from driftwalk.track.blobs import BlobDetector, median_background
from driftwalk.track.camera import Camera, Lens, load_camera, save_camera
from driftwalk.track.frames import FrameCounts, FrameSource, open_source
from driftwalk.track.live_camera import LiveCamera
from driftwalk.track.markers import MarkerColour, TwoColourMarker, load_markers, save_markers
from driftwalk.track.two_colour import TwoColourDetector
from driftwalk.track.types import Detection, Detector, Frame, FrameResult, PixelToWorld, Rejected

__all__ = [
    "BlobDetector",
    "Camera",
    "Detection",
    "Detector",
    "Frame",
    "FrameCounts",
    "FrameResult",
    "FrameSource",
    "Lens",
    "LiveCamera",
    "MarkerColour",
    "PixelToWorld",
    "Rejected",
    "TwoColourDetector",
    "TwoColourMarker",
    "load_camera",
    "load_markers",
    "median_background",
    "open_source",
    "save_camera",
    "save_markers",
]
