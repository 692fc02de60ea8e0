"""Text of arguments, JSON, TOML and messages."""
