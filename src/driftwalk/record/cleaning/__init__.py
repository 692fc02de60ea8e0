"""Rows that no body gives: wrong clocks, jumps, several bodies read as one."""
