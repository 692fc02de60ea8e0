"""
What four blocks build, and how fast
====================================

The outcome classes of 1000 simulated runs with their 90 % intervals, and the share of runs that is
not yet complete over time.
"""

import matplotlib.pyplot as plt

import driftwalk as dw

study = dw.Study(assembly={"blocks": 4, "runs": 1000, "duration_s": 300.0})
assembly = dw.assemble(study, dw.tank30_flow())

figure, axes = plt.subplots(1, 2, figsize=(6.3, 2.7), layout="constrained", width_ratios=(3, 2))
dw.plot.outcomes(dw.outcome_distribution(assembly), axes[0])
dw.plot.survival(dw.class_times(assembly), axes[1])
axes[1].set_title("", loc="left")
