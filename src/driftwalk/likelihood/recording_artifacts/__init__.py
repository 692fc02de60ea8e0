"""Artifacts of a recording, as its track shows them: dropped frames, smoothing, no noise at all."""
