"""Pose from keypoints: position and orientation of a body from its tracked points."""
