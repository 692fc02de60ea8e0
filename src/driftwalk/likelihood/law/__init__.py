"""The force law that a recording supports, and what else of the model it asks to change."""
