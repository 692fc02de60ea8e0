"""Sensitivity analysis: maps of the outcomes over settings, and Sobol' indices."""
