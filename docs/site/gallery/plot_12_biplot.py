"""
How outcomes depend on the model
================================

Self-assembly at a grid of drag coefficients and stochastic forces: how far the outcomes lie from
those of a reference, and the principal components of the outcomes with the classes as arrows.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwalk as dw

study = dw.Study(sensitivity={"runs": 100, "reference_realisations": 3})
flow = dw.tank30_flow()
reference = dw.sensitivity_reference(study, flow)
axes_of_map = {
    "drag_coefficient": np.linspace(0.2, 1.4, 7),
    "force_std": np.linspace(0.2e-3, 1.4e-3, 7),
}
sensitivity = dw.sensitivity_map(study, flow, axes=axes_of_map, reference=reference)

figure, ax = plt.subplots(figsize=(4.2, 3.1), layout="constrained")
dw.plot.l1_map(sensitivity, ax)

# %%
components = dw.principal_components(sensitivity)
figure, ax = plt.subplots(figsize=(5, 3.6), layout="constrained")
dw.plot.biplot(components, ax, sensitivity=sensitivity)
