"""Commands that predict: motion, self-assembly, sensitivity, the live tank."""
