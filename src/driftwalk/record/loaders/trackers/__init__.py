"""Formats of programs that follow bodies in videos."""
