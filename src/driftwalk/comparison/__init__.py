"""How far apart are two motions? Steps, the two-sample 2-D KS distance, its significance.

`compare` does it all for two trajectories; `steps` gives the steps of one; `ks_distance` is a
general tool for any two sets of points in the plane.
"""

from driftwalk.comparison.ks import (
    QUADRANTS,
    ComparisonWarning,
    KsComparison,
    KsPlace,
    KsReference,
    ks_compare,
    ks_distance,
    ks_reference,
)
from driftwalk.comparison.motion import compare, compare_replicates
from driftwalk.comparison.plan import AppliedSteps, StepPlan, apply_steps, plan_steps, steps
from driftwalk.comparison.significance import (
    PermutationTest,
    autocorrelation_time,
    block_permutation_test,
    memory_time,
)
from driftwalk.comparison.statistic import (
    Distances,
    Statistic,
    StepDistance,
    StepReference,
    StepTable,
    joint_density,
    step_length_edges,
    step_table,
    turning_angle_edges,
)

__all__ = [
    "QUADRANTS",
    "AppliedSteps",
    "ComparisonWarning",
    "Distances",
    "KsComparison",
    "KsPlace",
    "KsReference",
    "PermutationTest",
    "Statistic",
    "StepDistance",
    "StepPlan",
    "StepReference",
    "StepTable",
    "apply_steps",
    "autocorrelation_time",
    "block_permutation_test",
    "compare",
    "compare_replicates",
    "joint_density",
    "ks_compare",
    "ks_distance",
    "ks_reference",
    "memory_time",
    "plan_steps",
    "step_length_edges",
    "step_table",
    "steps",
    "turning_angle_edges",
]
