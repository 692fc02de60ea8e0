"""The figures of a run for print, with their numbers."""
