"""Discs that latch where they touch, in plain NumPy; shares no code with driftwalk.

Assemblies are rigid: each disc feels the water at its own place, its drag acts there, and none is
hidden by another.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import plain_bodies as plain


@dataclass
class Cluster:
    """Discs by number, their places about the centre of mass, and its state.

    The state is place, angle, velocity and spin; the inertia that over the mass of a disc [m^2].
    """

    members: list[int]
    arms: plain.Complexes
    state: plain.Complexes

    def inertia(self, radius: float) -> float:
        return len(self.members) * radius**2 / 2 + float((np.abs(self.arms) ** 2).sum())

    def places(self, state: plain.Complexes | None = None) -> plain.Complexes:
        z = self.state if state is None else state
        return np.asarray(z[0] + self.arms * np.exp(1j * z[1].real))

    def rate(
        self, state: plain.Complexes, disc: plain.Plain, water: plain.Water, scale: float,
        mass: float,
    ) -> plain.Complexes:  # fmt: skip
        force, torque = 0j, 0.0
        for place in self.places(state):
            arm, spin = place - state[0], state[3].real
            own = plain.drag(disc, water, scale, place, 0.0, state[2] + 1j * spin * arm, spin)
            force += own[0]
            torque += own[1] + (arm.conjugate() * own[0]).imag
        n = len(self.members)
        spun = torque / mass / self.inertia(disc.radius)
        return np.array([state[2], state[3], force / (n * mass), spun])


def joined(one: Cluster, other: Cluster, radius: float) -> Cluster:
    """Keep momentum and angular momentum."""
    n, m = len(one.members), len(other.members)
    place, velocity = ((n * one.state[k] + m * other.state[k]) / (n + m) for k in (0, 2))
    spin = 0.0
    for part in (one, other):
        arm, slip = part.state[0] - place, part.state[2] - velocity
        spin += part.inertia(radius) * part.state[3].real
        spin += len(part.members) * float((arm.conjugate() * slip).imag)
    arms = np.concatenate([one.places(), other.places()]) - place
    made = Cluster([*one.members, *other.members], arms, np.array([place, 0, velocity, 0], complex))
    made.state[3] = spin / made.inertia(radius)
    return made


def assembled(
    start: plain.Complexes, disc: plain.Plain, water: plain.Water, scale: float, mass: float,
    times: plain.Floats, *, step: float = 5e-3,
) -> tuple[plain.Complexes, list[float]]:  # fmt: skip
    """Return the places of the discs at some times, from rest, and when they touched."""
    clusters = [Cluster([k], np.zeros(1, complex), np.array([z, 0, 0, 0], complex))
                for k, z in enumerate(start)]  # fmt: skip
    kept, contacts, now = [start], [], 0.0

    def ahead(h: float) -> list[plain.Complexes]:
        found = []
        for one in clusters:
            k1 = one.rate(one.state, disc, water, scale, mass)
            k2 = one.rate(one.state + 0.5 * h * k1, disc, water, scale, mass)
            k3 = one.rate(one.state + 0.5 * h * k2, disc, water, scale, mass)
            k4 = one.rate(one.state + h * k3, disc, water, scale, mass)
            found.append(one.state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4))
        return found

    def closest(states: list[plain.Complexes]) -> tuple[float, int, int]:
        places = [one.places(state) for one, state in zip(clusters, states, strict=True)]
        gaps = [
            (float(np.abs(places[a][:, None] - places[b]).min()) - 2 * disc.radius, a, b)
            for a in range(len(places)) for b in range(a)
        ]  # fmt: skip
        return min(gaps, default=(1.0, 0, 0))

    for end in times[1:]:
        while end - now > 1e-12:
            h = min(step, end - now)
            states = ahead(h)
            if closest(states)[0] < 0:
                low, high = 0.0, h
                for _ in range(40):
                    middle = (low + high) / 2
                    low, high = (
                        (low, middle) if closest(ahead(middle))[0] < 0 else (middle, high)
                    )  # fmt: skip
                h, states = high, ahead(high)
            for one, state in zip(clusters, states, strict=True):
                one.state = state
            now += h
            gap, a, b = closest(states)
            if gap <= 0:
                contacts.append(now)
                both = joined(clusters[a], clusters[b], disc.radius)
                clusters = [c for k, c in enumerate(clusters) if k not in (a, b)] + [both]
        row = np.zeros(start.size, complex)
        for one in clusters:
            row[one.members] = one.places()
        kept.append(row)
    return np.array(kept), contacts
