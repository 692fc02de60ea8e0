"""Recorded and simulated motion in the files of other programs."""
