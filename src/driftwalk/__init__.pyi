from driftwalk import (
    assembly as assembly,
    calibration as calibration,
    comparison as comparison,
    conditions as conditions,
    datasets as datasets,
    figures as figures,
    flow as flow,
    likelihood as likelihood,
    model as model,
    motion as motion,
    notebook as notebook,
    page as page,
    plot as plot,
    record as record,
    runs as runs,
    simulation as simulation,
    sweep as sweep,
    track as track,
    viewer as viewer,
)
from driftwalk.assembly import (
    LiveTank as LiveTank,
    ModeSource as ModeSource,
    TankBatch as TankBatch,
    assemble_drawn as assemble_drawn,
    assembly_path as assembly_path,
    assembly_sizes as assembly_sizes,
    attraction as attraction,
    class_times as class_times,
    classify as classify,
    l1_distance as l1_distance,
    l1_noise_floor as l1_noise_floor,
    make_modes as make_modes,
    outcome_distribution as outcome_distribution,
    path_recording as path_recording,
    plan_control as plan_control,
    principal_components as principal_components,
    sensitivity_indices as sensitivity_indices,
    sensitivity_map as sensitivity_map,
    sensitivity_reference as sensitivity_reference,
    steady_state as steady_state,
    try_control as try_control,
)
from driftwalk.calibration import (
    recover_model as recover_model,
)
from driftwalk.comparison import (
    ComparisonWarning as ComparisonWarning,
    block_permutation_test as block_permutation_test,
    compare_replicates as compare_replicates,
    ks_distance as ks_distance,
    steps as steps,
)
from driftwalk.conditions import (
    simulate_like as simulate_like,
)
from driftwalk.core.errors import (
    ConfigurationError as ConfigurationError,
    DriftwalkError as DriftwalkError,
    FormatError as FormatError,
    InputError as InputError,
    RunDirectoryError as RunDirectoryError,
)
from driftwalk.datasets import (
    render_video as render_video,
    tank30_flow as tank30_flow,
    tank30_recording as tank30_recording,
    tank30_truth as tank30_truth,
    video_settings as video_settings,
    video_truth as video_truth,
    write_video as write_video,
)
from driftwalk.flow import (
    extract_flow as extract_flow,
    flow_from_function as flow_from_function,
    flow_from_tracers as flow_from_tracers,
    jets_flow as jets_flow,
    load_flow as load_flow,
    save_flow as save_flow,
    uniform_flow as uniform_flow,
    vortex_flow as vortex_flow,
)
from driftwalk.likelihood import (
    check_model as check_model,
    fit_motion as fit_motion,
    fitted_flow as fitted_flow,
    recovery_study as recovery_study,
    score_fit as score_fit,
)
from driftwalk.model import (
    Study as Study,
    apply_overrides as apply_overrides,
    load_study as load_study,
)
from driftwalk.motion import (
    models as models,
    motion_model as motion_model,
)
from driftwalk.notebook import (
    assemble as assemble,
    calibrate as calibrate,
    compare as compare,
    compare_models as compare_models,
    fit as fit,
    infer_outcomes as infer_outcomes,
    kinetics as kinetics,
    maximise_yield as maximise_yield,
    report as report,
    simulate as simulate,
)
from driftwalk.page import (
    report_page as report_page,
    write_report as write_report,
)
from driftwalk.record import (
    describe as describe,
    load as load,
    readable_formats as readable_formats,
    save_trajectory as save_trajectory,
)
from driftwalk.track import (
    observe as observe,
    open_source as open_source,
)
from driftwalk.viewer import (
    serve as serve,
)

__version__: str
