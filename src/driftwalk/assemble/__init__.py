"""What many blocks build, with what certainty, and how much that depends on the model."""
