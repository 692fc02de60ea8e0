"""Runs under way: what their finished work units show so far."""
