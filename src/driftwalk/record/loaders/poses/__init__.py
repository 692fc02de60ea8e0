"""Formats of programs that follow the points of bodies in videos."""
