"""Parts that the figures share: style, labels with units, the tank's outline, shapes of blocks."""
