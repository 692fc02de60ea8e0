"""The water under a floating block, for MuJoCo: drag on strips, and the stochastic force.

    import mujoco, floating_block

    model = mujoco.MjModel.from_xml_path("tank.xml")
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    floating_block.install(model, data)
    while data.time < 10:
        mujoco.mj_step(model, data)

Needs numpy and mujoco, and the files block.json and flow.npz in its folder. SI units; angles in
rad, counter-clockwise; the origin is the tank's centre.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

HERE = Path(__file__).resolve().parent
JOINTS = ("block_x", "block_y", "block_theta")
# Words of the generator are unsigned numbers of 32 and 64 bits.
MASK_32, MASK_64 = 0xFFFFFFFF, 0xFFFFFFFFFFFFFFFF


class FloatingBlock:
    """The forces on one block.

    Parameters
    ----------
    folder : path-like
        Where block.json and flow.npz are.
    seed, replicate : int, optional
        Address of the random numbers: the same ones give the same force, here and in driftwalk.
    noise : bool
        Whether there is a stochastic force.

    Attributes
    ----------
    numbers : dict
        What block.json says, units in the keys. A change takes effect at the next `FloatingBlock`.
    """

    def __init__(
        self,
        folder: str | Path = HERE,
        *,
        seed: int | None = None,
        replicate: int = 0,
        noise: bool = True,
    ) -> None:
        self.numbers: dict[str, Any] = json.loads((Path(folder) / "block.json").read_text())
        self._lay_strips()
        with np.load(Path(folder) / "flow.npz", allow_pickle=False) as flow:
            self._take_flow(dict(flow))
        self.noise = noise and self.numbers["force_std_N"] > 0
        self.key = world_key(self.numbers["seed"] if seed is None else seed, replicate)
        self._drawn = (-1, 0j)
        self._step_begin = self._last_time = 0.0
        self._places: tuple[list[int], list[int]] | None = None

    def _lay_strips(self) -> None:
        """Put the strips of the four faces around the block: arms and normals as x + iy."""
        said = self.numbers
        strips, side = said["strips_per_face"], said["side_m"]
        width = side / strips
        offset = (np.arange(strips) + 0.5) * width - side / 2
        turns = np.exp(0.5j * np.pi * np.arange(4))[:, None]
        self._arms = ((side / 2 + 1j * offset) * turns).ravel()
        self._normals = np.repeat(turns.ravel(), strips)
        area = width * said["wetted_depth_m"]
        self._quadratic = 0.5 * said["water_density_kg_m3"] * said["drag_coefficient"] * area
        self._linear = said["linear_drag_kg_s"] / (4 * strips)
        self._exponent = said["drag_power"] - 2.0

    def _take_flow(self, flow: dict[str, Any]) -> None:
        x, y = flow["x_m"], flow["y_m"]
        self._shape = (y.size, x.size)
        self._origin = (float(x[0]), float(y[0]))
        self._spacing = tuple(float(a[-1] - a[0]) / (a.size - 1) for a in (x, y))
        self._velocity = (flow["u_m_s"] + 1j * flow["v_m_s"]).ravel()
        self._acceleration = None
        if "ax_m_s2" in flow:
            self._acceleration = (flow["ax_m_s2"] + 1j * flow["ay_m_s2"]).ravel()
            # The 3 x 3 Gauss points of the block.
            places, weights = np.polynomial.legendre.leggauss(3)
            across, along = (axis.ravel() for axis in np.meshgrid(places, places))
            self._points = (across + 1j * along) * self.numbers["side_m"] / 2
            self._weights = np.outer(weights, weights).ravel() / 4

    def _look_up(self, nodes: Any, places: Any) -> Any:
        """Return the bilinear field at places x + iy, beyond the grid the value of its edge."""
        rows, columns = self._shape
        column = np.clip((places.real - self._origin[0]) / self._spacing[0], 0, columns - 1)
        row = np.clip((places.imag - self._origin[1]) / self._spacing[1], 0, rows - 1)
        i = np.minimum(column.astype(int), columns - 2)
        j = np.minimum(row.astype(int), rows - 2)
        along, up = column - i, row - j
        at = j * columns + i
        below = nodes[at] * (1 - along) + nodes[at + 1] * along
        above = nodes[at + columns] * (1 - along) + nodes[at + columns + 1] * along
        return below * (1 - up) + above * up

    def water(
        self, x: float, y: float, theta: float, vx: float, vy: float, omega: float
    ) -> tuple[float, float, float]:
        """Return the force [N] and the torque [N m] of the water on a block."""
        turn = complex(math.cos(theta), math.sin(theta))
        arms = self._arms * turn
        relative = self._look_up(self._velocity, complex(x, y) + arms)
        relative = relative - (complex(vx, vy) + 1j * omega * arms)
        closing = -((self._normals * turn).conj() * relative).real
        conductance = self._quadratic * np.maximum(closing, 0.0)
        if self._exponent:
            square = np.abs(relative / self.numbers["drag_speed_m_s"]) ** 2
            conductance = conductance * np.maximum(square, 1e-9) ** (self._exponent / 2)
        force = (conductance + self._linear) * relative
        total, torque = complex(force.sum()), float((arms.conj() * force).imag.sum())
        if self._acceleration is not None:
            total, torque = self._add_acceleration(complex(x, y), turn, total, torque)
        return total.real, total.imag, torque

    def _add_acceleration(
        self, centre: complex, turn: complex, force: complex, torque: float
    ) -> tuple[complex, float]:
        """Add the push of water that accelerates: its mean over the block, and its moment."""
        said = self.numbers
        share, own = said["added_mass_share"], said["displaced_mass_kg"]
        arms = self._points * turn
        there = self._weights * self._look_up(self._acceleration, centre + arms)
        force += (own + share * said["mass_kg"]) * complex(there.sum())
        inertia = own * said["side_m"] ** 2 / 6 + share * said["inertia_kg_m2"]
        spin = float((arms.conj() * there).imag.sum())
        return force, torque + inertia * 6 / said["side_m"] ** 2 * spin

    def stochastic_force(self, interval: int) -> tuple[float, float]:
        """Return the stochastic force [N] of an interval; that from 0 s on has the number 0."""
        if not self.noise:
            return 0.0, 0.0
        last, share = self._drawn
        memory = self.numbers["force_memory_s"]
        if memory == 0 and interval != last:
            share = normal_pair(self.key, interval)
        elif interval != last:
            kept = math.exp(-self.numbers["force_interval_s"] / memory)
            # Back to the beginning: the force is made of all that came before it.
            last, share = (last, share) if 0 <= last < interval else (-1, 0j)
            for number in range(last + 1, interval + 1):
                first = math.sqrt((1 - kept) / (1 + kept))
                fresh = normal_pair(self.key, number)
                share = kept * share + (1 - kept) * fresh if number else first * fresh
        self._drawn = (interval, share)
        force = self.numbers["force_std_N"] * share
        return force.real, force.imag

    def _interval(self, time: float, step: float) -> int:
        """Return the interval of the step that an evaluation at a time belongs to.

        RK4 evaluates the end of a step too, where the next interval may have begun. An evaluation
        within the step comes before it, which tells it from the beginning of the next step.
        """
        slack = 1e-6 * step
        begin, last = self._step_begin, self._last_time
        end = begin + step
        ends = begin + slack < last < end - slack and time < end + slack
        if time < begin - slack or not (time < end - slack or ends):
            self._step_begin = time
        self._last_time = time
        return int(self._step_begin / self.numbers["force_interval_s"] + 1e-6)

    def push(self, model: Any, data: Any) -> None:
        """Add the forces to MuJoCo's passive forces; what the callback does."""
        if self._places is None:
            joints = [model.joint(name) for name in JOINTS]
            self._places = (
                [int(one.qposadr[0]) for one in joints],
                [int(one.dofadr[0]) for one in joints],
            )
        pose, speed = self._places
        x, y, torque = self.water(*data.qpos[pose].tolist(), *data.qvel[speed].tolist())
        drawn = self.stochastic_force(self._interval(data.time, model.opt.timestep))
        data.qfrc_passive[speed] += (x + drawn[0], y + drawn[1], torque)


def install(
    model: Any,
    data: Any,
    folder: str | Path = HERE,
    *,
    seed: int | None = None,
    replicate: int = 0,
    noise: bool = True,
) -> FloatingBlock:
    """Let the water act on the block of `data`, from now on, and return the forces.

    MuJoCo has one callback for everything: other data are left alone, and
    `mujoco.set_mjcb_passive(None)` takes the water away.
    """
    block = FloatingBlock(folder, seed=seed, replicate=replicate, noise=noise)

    def water(stepped: Any, state: Any) -> None:
        if (stepped._address, state._address) == (model._address, data._address):
            block.push(stepped, state)

    mujoco.set_mjcb_passive(water)
    return block


def world_key(seed: int, replicate: int) -> int:
    """Return the key of a world's random numbers (three rounds of SplitMix64)."""
    trial = 0
    return _mix(_mix(_mix(seed) ^ trial) ^ replicate)


def _mix(value: int) -> int:
    value = (value + 0x9E3779B97F4A7C15) & MASK_64
    value = ((value ^ (value >> 30)) * 0xBF58476D1CE4E5B9) & MASK_64
    value = ((value ^ (value >> 27)) * 0x94D049BB133111EB) & MASK_64
    return value ^ (value >> 31)


def philox(key: int, counter: tuple[int, int, int, int]) -> tuple[int, int, int, int]:
    """Return the four random words of a counter (Philox 4x32-10, Salmon et al., SC 2011)."""
    (c0, c1, c2, c3), k0, k1 = counter, key & MASK_32, key >> 32
    for _ in range(10):
        first, second = 0xD2511F53 * c0, 0xCD9E8D57 * c2
        c0, c1, c2, c3 = (
            (second >> 32) ^ c1 ^ k0,
            second & MASK_32,
            (first >> 32) ^ c3 ^ k1,
            first & MASK_32,
        )
        k0, k1 = (k0 + 0x9E3779B9) & MASK_32, (k1 + 0xBB67AE85) & MASK_32
    return c0, c1, c2, c3


def normal_pair(key: int, interval: int) -> complex:
    """Return two standard normal numbers as a + ib; one block of words serves two intervals."""
    body, purpose = 0, 1
    words = philox(key, (interval >> 1 & MASK_32, body, interval >> 33, purpose))
    first, second = words[2:] if interval & 1 else words[:2]
    uniform = ((first >> 8) + 1) * 2.0**-24
    turn = (second >> 30) + ((second >> 8) & 0x3FFFFF) * 2.0**-22 - 0.5
    radius, angle = math.sqrt(-2.0 * math.log(uniform)), turn * math.pi / 2
    return radius * complex(math.cos(angle), math.sin(angle))
