"""Types of the native core. Private: use the functions of the stages instead."""

from typing import Any

import numpy as np
import numpy.typing as npt

_Floats = npt.NDArray[np.float64]
_Place = tuple[float, float, int, int]

# --- the KS statistic ---------------------------------------------------------------------------
# D1 and D2 in units of 1 / (n1 n2), n1, n2, points that tie (a part of more than `most_tied`),
# place of D1, place of D2
KsResult = tuple[int, int, int, int, int, _Place, _Place]

class KsReference:
    def __init__(self, points: _Floats) -> None: ...
    @property
    def size(self) -> int: ...
    def compare(self, points: _Floats, limits: bool, most_tied: int = ...) -> KsResult: ...
    def peacock(self, points: _Floats) -> tuple[int, int, _Place]: ...

def ks_compare(a: _Floats, b: _Floats, limits: bool, most_tied: int = ...) -> KsResult: ...
def ks_permutations(
    pooled: _Floats,
    n1: int,
    block_of: npt.NDArray[np.int32],
    labels: npt.NDArray[np.uint8],
    limits: bool,
) -> npt.NDArray[np.int64]: ...

# --- steps --------------------------------------------------------------------------------------
def apply_step_plan(
    left: npt.NDArray[np.int32],
    weight: _Floats,
    triple: npt.NDArray[np.int32],
    x: npt.NDArray[Any],
    y: npt.NDArray[Any],
) -> tuple[_Floats, _Floats, npt.NDArray[np.int32], int, int]: ...

# --- simulation ---------------------------------------------------------------------------------
_Keys = npt.NDArray[np.uint64]
_Counts = npt.NDArray[np.int64]

class Model:
    # The numbers, and what each may be, are declared in
    # cpp/include/driftwalk/simulate/model_numbers.hpp. All are given, and can be read back.
    def __init__(
        self,
        *,
        edges: _Floats,
        u: _Floats,
        v: _Floats,
        frame_time: _Floats,
        sample_time: _Floats,
        view_edges: _Floats,
        flow_repeat: str = "hold",  # hold, loop or mirror
        # of a body that is no square block: (n, 5) x, y, nx, ny, width; (n, 2); (4, 2)
        panels: _Floats | None = None,
        corners: _Floats | None = None,
        moment_points: _Floats | None = None,
        **numbers: float,
    ) -> None: ...
    def __getattr__(self, number: str) -> float: ...
    @property
    def samples(self) -> int: ...

# A self-propelled particle instead of the block; `columns` are those of a world after its start.
class Particle:
    # neighbours: where others are at each time step, shape (steps, neighbours, 2), NaN where not
    def __init__(
        self,
        *,
        kind: str,
        states: int,
        contact: str,
        carried: bool,
        neighbours: _Floats | None = None,
    ) -> None: ...
    @property
    def columns(self) -> int: ...

# x, y, theta of shape (worlds, samples), float32 or float64 by precision, and status (worlds,).
# flow_start (worlds,): time on the clock of the flow's frames at which each begins [s], or 0.
def simulate(
    model: Model,
    worlds: _Floats,
    key: _Keys,
    *,
    threads: int,
    precision: str,
    particle: Particle | None = None,
    flow_start: _Floats | None = None,
) -> tuple[npt.NDArray[Any], npt.NDArray[Any], npt.NDArray[Any], npt.NDArray[np.uint32]]: ...
def score(
    model: Model,
    worlds: _Floats,
    key: _Keys,
    *,
    left: npt.NDArray[np.int32],
    weight: _Floats,
    triple: npt.NDArray[np.int32],
    reference: _Floats | None,
    bins: int,
    length_limit: float,
    angle_limit: float,
    excerpt: int,
    keep_steps: bool,
    threads: int,
    particle: Particle | None = None,
    flow_start: _Floats | None = None,
) -> dict[str, npt.NDArray[Any]]: ...
def ks_matrix(
    a_length: _Floats,
    a_angle: _Floats,
    a_count: _Counts,
    b_length: _Floats,
    b_angle: _Floats,
    b_count: _Counts,
    *,
    threads: int,
) -> _Floats: ...

# Drag force x, y [N] and torque [N m], the linear part included.
def drag(
    model: Model,
    *,
    drag_coefficient: float,
    x: float,
    y: float,
    theta: float,
    vx: float,
    vy: float,
    omega: float,
) -> tuple[float, float, float]: ...
def philox(key: int, counter: list[int]) -> list[int]: ...
def instruction_set() -> str: ...
def available_instruction_sets() -> list[str]: ...

# --- self-assembly ------------------------------------------------------------------------------
# Start poses [m, m, rad] of shape (worlds, blocks, 3), and how many blocks of each world found a
# place; `glued`: cells (n, 2) of bodies of n blocks each.
# Tables of the forces between blocks, see `driftwalk.assembly.pull.force_tables`.
class Pull:
    def __init__(
        self,
        *,
        reach: float,
        lever: float,
        pole: _Floats,
        like_poles_repel: bool,
        every: int,
        near_fading: float,
        near_end: float,
        near_reach: float,
    ) -> None: ...
    def set_radial(self, what: str, cells: _Floats, first: int) -> None: ...
    def set_oriented(
        self, coefficient: _Floats, *, first: float, per_step: float, low: float, high: float
    ) -> None: ...
    def set_multipoles(
        self, coefficient: _Floats, *, softening: float, fading: float, end: float
    ) -> None: ...

def place_blocks(
    model: Model,
    *,
    blocks: int,
    key: _Keys,
    threads: int,
    glued: npt.NDArray[np.int32] | None = None,
) -> tuple[_Floats, npt.NDArray[np.int32]]: ...

# Typed faces. latches (types, types), 0 or 1; of each kind type and pole (kinds, 4), of the faces
# +x, +y, -x, -y, and count (kinds,) at the start; becomes (kinds * 4, types): kinds after a latch.
class FaceRules:
    def __init__(
        self,
        *,
        latches: npt.NDArray[np.int32],
        type: npt.NDArray[np.int32],
        pole: npt.NDArray[np.int32],
        count: npt.NDArray[np.int32],
        becomes: npt.NDArray[np.int32],
    ) -> None: ...

def assemble(
    model: Model,
    *,
    start: _Floats,
    key: _Keys,
    drag_coefficient: _Floats,
    force_std: _Floats,
    steps: int,
    latching: str,
    connector_distance: float,
    connector_axis: float,
    hidden_share: float,
    stirring_length: float,
    incompressible: bool,
    block_restitution: float,
    block_friction: float,
    sample_every: int,
    threads: int,
    precision: str,
    faces: FaceRules | None = None,
    flow_start: _Floats | None = None,
    # rate [1/s] and force [N] (Bell), strength [N], clearance [sides]; with bonds that break the
    # result has event_kind: 0 joining, 1 parting, 2 opening and 3 closing of a bond of a loop; and
    # event_count counts events beyond event_rows, which are not written
    bonds: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.25),
    event_rows: int = 0,
    glued: npt.NDArray[np.int32] | None = None,
    pull: Pull | None = None,
) -> dict[str, npt.NDArray[Any] | int]: ...

# A world that keeps its state between calls, in double precision. Changes take effect with the next
# step.
class LiveWorld:
    def __init__(
        self,
        model: Model,
        *,
        start: _Floats,
        key: int,
        drag_coefficient: float,
        force_std: float,
        latching: str,
        connector_distance: float,
        connector_axis: float,
        hidden_share: float,
        stirring_length: float,
        incompressible: bool,
        block_restitution: float,
        block_friction: float,
        faces: FaceRules | None = None,
        flow_start: float = 0.0,
        bonds: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.25),
    ) -> None: ...
    # The events: step (n,), kind (n,), block (n, 2), face (n, 2), as in `assemble`. It takes fewer
    # steps when there are too many events.
    def advance(self, steps: int) -> dict[str, npt.NDArray[np.int32]]: ...
    # pose (blocks, 3) [m, m, rad], velocity (blocks, 3) [m/s, m/s, rad/s], assembly (blocks,),
    # cell (blocks, 2), quarter (blocks,); where bonds break bond (n, 2), those that are whole.
    # cell (blocks, 2), quarter and kind (blocks,).
    def state(self) -> dict[str, npt.NDArray[Any]]: ...
    def set_forces(
        self, *, drag_coefficient: float, force_std: float, flow_scale: float
    ) -> None: ...
    def set_rules(self, *, latching: str, hidden_share: float, stirring_length: float) -> None: ...
    def set_bonds(self, *, rate: float, relatch_clearance: float) -> None: ...
    # Blocks are of the kinds at the start again.
    def set_faces(self, faces: FaceRules | None) -> None: ...
    def set_pull(self, pull: Pull | None) -> None: ...
    def set_blocks(self, blocks: int) -> int: ...  # as many as there are then
    def part(self) -> None: ...
    @property
    def step(self) -> int: ...
    @property
    def status(self) -> int: ...

class TankBatch:
    # start (worlds, blocks, 3) [m, m, rad], key (worlds,); flow_start: of each model (worlds,) [s].
    # joined: velocity (worlds, blocks, 3), assembly, cell (worlds, blocks, 2), quarter and kind of
    # worlds that begin with assemblies.
    def __init__(
        self,
        models: list[Model],
        *,
        start: _Floats,
        key: _Keys,
        precision: str,
        connector_distance: float,
        connector_axis: float,
        hidden_share: float,
        stirring_length: float,
        incompressible: bool,
        block_restitution: float,
        block_friction: float,
        faces: FaceRules | None,
        bonds: tuple[float, float, float, float],
        pull: Pull | None,
        glued: npt.NDArray[np.int32] | None,
        flow_start: list[_Floats | None],
        joined: dict[str, npt.NDArray[Any]] | None,
        threads: int,
    ) -> None: ...
    # One entry per world. flow: index of the model, -1: the world rests. latching: 0 none,
    # 1 collision, 2 connector.
    def advance(
        self,
        steps: int,
        *,
        flow: npt.NDArray[np.int32],
        latching: npt.NDArray[np.int32],
        flow_scale: _Floats,
        drag_coefficient: _Floats,
        force_std: _Floats,
        threads: int,
    ) -> None: ...
    def take(self, worlds: list[int], key: _Keys) -> TankBatch: ...
    # As that of a LiveWorld, of all worlds, without bonds.
    def state(self) -> dict[str, npt.NDArray[Any]]: ...
    def status(self) -> npt.NDArray[np.uint32]: ...
    # Step after which blocks joined or parted last; 0: not since the start.
    def last_event(self) -> npt.NDArray[np.int32]: ...
    @property
    def step(self) -> int: ...

# --- the likelihood fit -------------------------------------------------------------------------
class InnovationsFilter:
    # Time [s] increasing; x and y [m], NaN where a sample is missing. excluded: 1 where the
    # interval that ends at the sample says nothing about the water. Coefficients of u and v
    # (2, rows, columns) [m/s], or (2 K, rows, columns) of K layers whose sum is the flow.
    # noise_intensity: sigma_F^2 * force_interval / mass^2 [m^2/s^3].
    # orientation: "given": theta [rad], without jumps by 2 pi, and omega [rad/s] are inputs, finite
    # everywhere; "none": the drag is averaged over the angle; "state": theta is measured like x and
    # y, NaN where missing, with angle_noise [rad], and the force acts force_lever [m] from the
    # centre. strength: of each layer at the samples (K, n), linear between them; one layer without
    # it has the strength 1. quadratic, linear [m/s]: a strip's drag is K (quadratic
    # max(0, closing) + linear) times its slip; with another drag_power than 2, and no linear part,
    # that times (speed past the strip / drag_speed [m/s])^(drag_power - 2). water_acceleration and
    # water_spin: how strongly Du/Dt and half its curl push the block, 0 or 1. time_noise: of the
    # stamps [s]. force_memory: correlation time of the force [s]. velocity_prior (n, 6): mean and
    # standard deviation of vx, vy [m/s] and omega [rad/s] if the state begins at the sample, NaN
    # where nothing is known.
    def __init__(
        self,
        time: _Floats,
        x: _Floats,
        y: _Floats,
        theta: _Floats,
        omega: _Floats,
        excluded: npt.NDArray[np.uint8],
        *,
        side: float,
        mass: float,
        depth: float,
        strips: int,
        water_density: float,
        origin_x: float,
        origin_y: float,
        spacing: float,
        columns: int,
        rows: int,
        coefficients: _Floats,
        drag_coefficient: float,
        noise_intensity: float,
        position_noise: float,
        force_lever: float = 0.0,
        angle_noise: float = 0.01,
        largest_step: float = 0.05,
        longest_gap: float = 1.0,
        orientation: str = "given",
        sensitivities: bool = False,
        strength: _Floats | None = None,
        quadratic: float = 1.0,
        linear: float = 0.0,
        water_acceleration: float = 0.0,
        water_spin: float = 0.0,
        drag_power: float = 2.0,
        drag_speed: float = 0.03,
        time_noise: float = 0.0,
        force_memory: float = 0.0,
        velocity_prior: _Floats | None = None,
    ) -> None: ...
    @property
    def samples(self) -> int: ...
    @property
    def remaining(self) -> int: ...
    @property
    def parameters(self) -> int: ...
    @property
    def coordinates(self) -> int: ...  # D: 3 with orientation "state", else 2

    # The next k = min(count, remaining) samples: innovation (k, D) and covariance (k, D (D + 1)/2)
    # as xx, xy, yy, x theta, y theta, theta theta, NaN where a sample has none; used (k,) uint8;
    # state (k, 2 D) after the sample, NaN while there is none. With sensitivities whitened (D k,)
    # and jacobian (D k, parameters) of the prediction in the same units, the coordinates of a
    # sample in turn, zero where not used; with pooled > 1 the sums of jacobian over that many
    # samples.
    # With errors=True also errors (n, 3, S, S): how the error of the state goes on from the sample
    # before, 0 where the state begins; its covariance before the sample, and after it.
    def run(
        self, count: int, *, states: bool = True, pooled: int = 1, errors: bool = False
    ) -> dict[str, npt.NDArray[Any]]: ...

    # Over the n samples that remain: information (parameters, parameters) = J' J and products
    # (columns, parameters) = R' J, J the rows of jacobian of samples that are used and kept (n,),
    # R right (n, D, columns); without them all that are used, and the whitened innovations. Up to
    # pooled samples in a row enter J' J as their mean. With innovation, covariance and used.
    def sums(
        self,
        kept: npt.NDArray[np.uint8] | None,
        right: _Floats | None,
        *,
        pooled: int = 1,
    ) -> dict[str, npt.NDArray[Any]]: ...

# The mean acceleration (D,) [m/s^2, rad/s^2] of a block whose (x, y, vx, vy) has this mean and
# covariance, by_position and by_velocity (D, D), by_coefficients (D, 2, rows, columns). With
# orientation "state" mean and covariance are those of (x, y, theta, vx, vy, omega), and theta and
# omega are not read.
def expected_drag(
    *,
    side: float,
    mass: float,
    depth: float,
    strips: int,
    water_density: float,
    origin_x: float,
    origin_y: float,
    spacing: float,
    columns: int,
    rows: int,
    coefficients: _Floats,
    drag_coefficient: float,
    orientation: str,
    mean: _Floats,
    theta: float,
    omega: float,
    covariance: _Floats,
    quadratic: float = 1.0,
    linear: float = 0.0,
    water_acceleration: float = 0.0,
    water_spin: float = 0.0,
    drag_power: float = 2.0,
    drag_speed: float = 0.03,
) -> dict[str, _Floats]: ...
