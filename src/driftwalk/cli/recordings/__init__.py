"""Commands that make, read and watch recordings."""
