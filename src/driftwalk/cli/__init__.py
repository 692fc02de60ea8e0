"""The command line: one file per command, each of which parses, calls a stage, and writes."""

__all__: list[str] = []
