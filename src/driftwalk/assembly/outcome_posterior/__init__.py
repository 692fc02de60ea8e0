"""Parameters from outcomes alone: a Gaussian-process emulator, with a self-check of its regions."""
