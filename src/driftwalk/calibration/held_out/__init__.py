"""Motion models judged on held-out blocks of a recording."""
