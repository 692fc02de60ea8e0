"""JSON and TOML read within bounds, and names in messages."""
