"""Readers of flow-field files: one file per layout."""

__all__: list[str] = []
