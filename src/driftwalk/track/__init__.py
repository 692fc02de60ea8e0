"""Where is every block? From a camera or a video to poses, with reasons for what was left out."""

from driftwalk.track.camera import Camera, Lens, load_camera, save_camera
from driftwalk.track.detect.blobs import BlobDetector, median_background, usual_polarity
from driftwalk.track.detect.markers import MarkerColour, TwoColourMarker, load_markers, save_markers
from driftwalk.track.detect.tags import TagDetector
from driftwalk.track.detect.teach import (
    ColourSeen,
    MarkerProposal,
    colours_seen,
    missing_colours,
    propose_markers,
)
from driftwalk.track.detect.two_colour_detector import TwoColourDetector
from driftwalk.track.follow.settings import TrackerSettings
from driftwalk.track.follow.tracker import Tracker, TrackState
from driftwalk.track.frames import FrameCounts, FrameSource, LiveCamera
from driftwalk.track.lens import Board, LensCalibration, calibrate_lens, camera_from_board
from driftwalk.track.live import LiveServer, Particle, nmea_frame
from driftwalk.track.observer import AssemblyObserver, AssemblySeen, SeenEvent, observe
from driftwalk.track.overlay import OverlayWriter, draw_states, explain_frame, save_picture
from driftwalk.track.rim import Rim, camera_from_rim, centre_on_rim, find_rim
from driftwalk.track.sampled_frames import frame_count, open_source, sample_images
from driftwalk.track.types import Detection, Detector, Frame, PixelToWorld, Rejected

__all__ = [
    "AssemblyObserver",
    "AssemblySeen",
    "BlobDetector",
    "Board",
    "Camera",
    "ColourSeen",
    "Detection",
    "Detector",
    "Frame",
    "FrameCounts",
    "FrameSource",
    "Lens",
    "LensCalibration",
    "LiveCamera",
    "LiveServer",
    "MarkerColour",
    "MarkerProposal",
    "OverlayWriter",
    "Particle",
    "PixelToWorld",
    "Rejected",
    "Rim",
    "SeenEvent",
    "TagDetector",
    "TrackState",
    "Tracker",
    "TrackerSettings",
    "TwoColourDetector",
    "TwoColourMarker",
    "calibrate_lens",
    "camera_from_board",
    "camera_from_rim",
    "centre_on_rim",
    "colours_seen",
    "draw_states",
    "explain_frame",
    "find_rim",
    "frame_count",
    "load_camera",
    "load_markers",
    "median_background",
    "missing_colours",
    "nmea_frame",
    "observe",
    "open_source",
    "propose_markers",
    "sample_images",
    "save_camera",
    "save_markers",
    "save_picture",
    "usual_polarity",
]
