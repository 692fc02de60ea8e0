"""Commands of self-assembly: what blocks build, how fast, and how to choose it."""
