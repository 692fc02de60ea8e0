"""
A recording
===========

A track of one block in a round tank, coloured by time; the circle is its start. `load` reads a
tracker's file; this one comes with driftwalk, simulated by another engine.
"""

import matplotlib.pyplot as plt

import driftwalk as dw

recording = dw.tank30_recording()
figure, ax = plt.subplots(figsize=(3.5, 3.1), layout="compressed")
dw.plot.trajectory(recording, ax, start=0.0, stop=120.0)
