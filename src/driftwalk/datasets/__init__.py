"""Stage of driftwalk (being built)."""

__all__: list[str] = []
