"""What the figures share: style, labels in readable units, the tank's outline, shapes of blocks."""
