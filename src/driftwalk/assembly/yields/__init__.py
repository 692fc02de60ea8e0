"""Yield of self-assembly: which settings give the most of a target, by ranking and selection."""
