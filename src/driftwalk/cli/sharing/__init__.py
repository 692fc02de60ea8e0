"""Commands that show a run to others."""
