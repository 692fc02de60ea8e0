"""A motion model that is a program: it answers lines of JSON with positions."""
