"""Everything that a command prints: answers, progress, errors."""
