"""Readers of flow-field files: one file per layout."""
