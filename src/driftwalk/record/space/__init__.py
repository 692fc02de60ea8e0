"""Poses in space, as motion capture and robots write them, laid into the plane of the water."""
