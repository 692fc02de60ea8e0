"""Label switching: two states of a model that could change places are put in order."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from driftwalk.calibration.held_out.candidates import Candidate
from driftwalk.core.arrays import Floats
from driftwalk.motion import ParticleModel

Order = Callable[[Floats], Floats]
"""Settings in the unit cube (n, parameters) to the same with their states in order."""


def label_order(entry: Candidate) -> Order:
    """Return the function that puts the states of a model in order.

    It changes nothing where a model has no such states, or they are searched in different ranges.
    """
    places = {one.name: index for index, one in enumerate(entry.ranges)}
    model = entry.model
    pairs = model.member.exchanged if isinstance(model, ParticleModel) else ()
    known = [(places.get(first), places.get(second)) for first, second in pairs]
    found = [(first, second) for first, second in known if first is not None is not second]
    alike = len(found) == len(pairs) and all(
        (entry.ranges[first].low, entry.ranges[first].high)
        == (entry.ranges[second].low, entry.ranges[second].high)
        for first, second in found
    )
    if not found or not alike:
        return lambda settings: settings
    firsts, seconds = (np.array(each) for each in zip(*found, strict=True))

    def order(settings: Floats) -> Floats:
        ordered = settings.copy()
        turned = settings[:, firsts[0]] > settings[:, seconds[0]]
        ordered[np.ix_(turned, firsts)] = settings[np.ix_(turned, seconds)]
        ordered[np.ix_(turned, seconds)] = settings[np.ix_(turned, firsts)]
        return ordered

    return order
