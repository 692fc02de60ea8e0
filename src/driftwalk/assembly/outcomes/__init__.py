"""Outcomes of assembly, how often and when: classes, distributions, distances, survival."""
