"""
A recording
===========

A track of one block in a round tank, coloured by time. `load` reads a tracker's file; this one
comes with driftwalk, simulated by another engine.
"""

import matplotlib.pyplot as plt

import driftwalk as dw

recording = dw.tank30_recording()
figure, ax = plt.subplots(figsize=(5.5, 4.4), layout="constrained")
dw.plot.trajectory(recording, ax, start=0.0, stop=120.0)
