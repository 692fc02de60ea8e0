"""The warnings of this stage."""

from __future__ import annotations


class ComparisonWarning(UserWarning):
    """A comparison was made, but the data limit its meaning."""
