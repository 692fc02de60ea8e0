"""Formats of poses in space: a file that defines ``LOADER`` is one; see `record.registry`."""
