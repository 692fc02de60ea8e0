"""Runs of a tank of blocks: their plan, starts, drawn parameters and dataset."""
