"""Several blocks: what glued ones, and free ones in one recording, feel of each other."""
