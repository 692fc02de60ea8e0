"""One section of a page per file, from the datasets that it needs."""
