"""What a file holds, and which formats it is nearest to."""
