"""Sections of pages on what blocks build, and how much that depends on the model."""
