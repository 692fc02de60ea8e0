"""Forces between blocks at a distance: their tables for the native core."""
