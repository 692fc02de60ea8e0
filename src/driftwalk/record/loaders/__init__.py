"""Formats: files that define ``LOADER``, or ``LOADERS`` of several; see `record.registry`."""
