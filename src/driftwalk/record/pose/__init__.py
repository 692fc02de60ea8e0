"""From the points of a body, seen one by one, to where it is and which way it points."""
