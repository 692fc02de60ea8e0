"""What a command prints: answers, progress, errors."""
