"""Blocks on the lattice of their assembly: shapes, joins, and what the events of a run built."""
