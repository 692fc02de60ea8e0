"""Outcomes of assembly: classes, distributions, distances, survival, bond kinetics."""
