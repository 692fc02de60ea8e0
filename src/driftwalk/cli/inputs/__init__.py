"""Inputs that the arguments of a command name: recordings, studies and flows, read and checked."""
