"""
Blocks assemble
===============

Four blocks with magnets float in the flow of the bundled recording. Where two meet face to face
they latch. The strip shows one of the simulated runs.
"""

import matplotlib.pyplot as plt

import driftwalk as dw

study = dw.Study(assembly={"blocks": 4, "duration_s": 240.0})
flow = dw.tank30_flow()
path = dw.assembly_path(study, flow, sample_interval=0.5)
figure, axes = plt.subplots(1, 6, figsize=(6.3, 1.3), layout="constrained")
dw.plot.film_strip(path, axes)
