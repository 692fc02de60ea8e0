"""A motion in some hundred summary statistics, recorded or simulated."""
