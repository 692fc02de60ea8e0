"""The NumPy twins of the native core: the same models, written plainly, as test oracles."""
