"""Restitution and friction of the wall, from the contacts that a recording has."""
