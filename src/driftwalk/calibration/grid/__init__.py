"""Calibration on a grid: KS distances, refinement, energy score, bootstrap region."""
