"""How well a set-up recovers known parameters: recordings simulated, estimated, and compared."""
