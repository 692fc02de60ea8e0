"""Which values of many parameters fit, and how well a recording determines them.

Two stages: a search by six two-dimensional KS distances (`driftwalk.calibration.evolution`), and
summaries of the motion, matched by their synthetic likelihood.
"""
