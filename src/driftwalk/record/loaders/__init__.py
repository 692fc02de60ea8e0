"""One file per format. A file that defines ``LOADER`` is a format; see `record.registry`."""
