"""Outcomes of assembly: classes, distributions, distances, survival."""
