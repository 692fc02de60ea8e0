"""Example recordings that come with the package, all of them simulated and named so."""

from driftwalk.datasets.synthetic_video import render_video, video_truth, write_video
from driftwalk.datasets.synthetic_video_settings import VIDEO_LEVELS, VideoSettings, video_settings
from driftwalk.datasets.tank30 import tank30_flow, tank30_recording, tank30_truth

__all__ = [
    "VIDEO_LEVELS",
    "VideoSettings",
    "render_video",
    "tank30_flow",
    "tank30_recording",
    "tank30_truth",
    "video_settings",
    "video_truth",
    "write_video",
]
