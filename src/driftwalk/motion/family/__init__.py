"""Which bodies move by themselves? The family of self-propelled motion models."""
