"""Cleaning: wrong clocks, outliers (jumps), duplicate times, several bodies read as one."""
