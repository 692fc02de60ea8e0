"""Multi-object tracking: detections to tracks."""
