"""Joins between tracked blocks, frame by frame."""
