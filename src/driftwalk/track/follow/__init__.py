"""From detections to tracks: which detection is which body."""
