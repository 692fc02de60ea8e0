"""Recognition of formats by the names that a file holds."""
