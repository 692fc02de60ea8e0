"""Other simulators, one file each, and what their exports share."""
