"""Mistakes of the camera and its tracker, as the track itself shows them."""
