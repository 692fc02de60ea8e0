"""How well a set-up recovers a known truth: simulated recordings, fitted and scored."""
