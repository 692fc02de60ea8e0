"""The playground as one file: the page, the native core as WebAssembly, and all that both need."""

from __future__ import annotations

import base64
import math
import zlib
from collections.abc import Callable
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.lattice.joined_faces import face_table
from driftwalk.assembly.outcomes.outcome_classes import BODY_CONTACT
from driftwalk.assembly.pull.force_tables import block_pull
from driftwalk.assembly.runs.plan import Plan, make_plan, whole_steps
from driftwalk.comparison.significance import steps_memory_time, usual_block_length
from driftwalk.core.errors import InputError
from driftwalk.core.random_streams import trial_in
from driftwalk.model import apply_overrides
from driftwalk.page.html import CORE, bundle_bytes, write_report
from driftwalk.page.parts import section
from driftwalk.schema.shapes import MOST_NAMED
from driftwalk.simulation.backend import Camera, model_arguments
from driftwalk.viewer.play.playground import PlaySource

if TYPE_CHECKING:
    from driftwalk.model import Study

WORDS = {"latching": ("none", "collision", "connector"), "flow_repeat": ("hold", "loop", "mirror")}
"""Words by their numbers in the native core."""


def save_playground(
    source: PlaySource, path: str | Path, *, existing: Literal["error", "replace"] = "error"
) -> Path:
    """Write the playground of a tank as one HTML file that needs no server and loads nothing.

    Parameters
    ----------
    source : PlaySource
        The tank with its knobs, and the recording to compare with.
    path : path-like
        The file, which ends in ``.html`` or ``.htm``.
    existing : {"error", "replace"}
        Behaviour if the file exists already.

    Returns
    -------
    pathlib.Path
        The file. The same tank gives the same bytes.

    Raises
    ------
    InputError
        As `write_report`.

    Examples
    --------
    ``save_playground(PlaySource(study, flow), "tank.html")``
    """
    page = source.greeting()[0]["page"]
    note = (
        "Runs of the tank as it is set now, each until all blocks are one assembly or "
        f"{source.tank.study.assembly.duration_s:g} s have passed. Of more than 8 blocks the "
        "sizes of the assemblies count, not their shapes."
    )
    page["sections"].append(section("outcomes", "outcomes", "Outcomes", note))
    return write_report(page, path, existing=existing, core=local_tank(source))


def local_tank(source: PlaySource) -> dict[str, Any]:
    """Return what a browser needs to run a tank: JSON-ready, in SI units.

    Parameters
    ----------
    source : PlaySource
        The tank.
    """
    study = source.tank.study
    plan = make_plan(study, source.water, settings={}, index=np.arange(1), ends=False)
    given = model_arguments(study, plan.flow, np.zeros(1), Camera())
    arrays = {name: value for name, value in given.items() if isinstance(value, np.ndarray)}
    numbers = {name: value for name, value in given.items() if isinstance(value, (int, float))}
    return {
        "wasm": _deflated(bundle_bytes(CORE)),
        "numbers": numbers,
        "arrays": {
            name: _doubles(arrays[name])
            for name in ("u", "v", "frame_time", "edges", "panels", "corners", "moment_points")
            if name in arrays
        },
        "nodes": list(arrays["u"].shape[1:]),
        "flow_repeat": WORDS["flow_repeat"].index(given.get("flow_repeat", "hold")),
        "flow_start": 0.0 if plan.flow_start is None else float(plan.flow_start[0]),
        "seed": study.assembly.seed,
        "trial": str(int(trial_in("run", 0))),
        "rules": _rules(plan),
        "choices": _choices(source),
        "chirality": study.assembly.chirality,
        "shape": study.block.shape,
        "width": study.block.width_m,
        "contact_gap": BODY_CONTACT.gap,
        "most_named": MOST_NAMED,
        "run_steps": whole_steps(study),
        "motion": _motion(source),
    }


def _rules(plan: Plan) -> dict[str, float]:
    """Return the rules of a world that no knob changes, and the first values of the others."""
    rules = plan.rules()
    rate, force, strength, clearance = rules["bonds"]
    return {
        "latching": WORDS["latching"].index(rules["latching"]),
        "connector_distance": rules["connector_distance"],
        "connector_cosine": math.cos(rules["connector_axis"]),
        "hidden_share": rules["hidden_share"],
        "stirring_length": rules["stirring_length"],
        "incompressible": float(rules["incompressible"]),
        "block_restitution": rules["block_restitution"],
        "block_friction": rules["block_friction"],
        "bond_rate": rate,
        "bond_force": force,
        "bond_strength": strength,
        "relatch_clearance": clearance,
    }


def _choices(source: PlaySource) -> dict[str, dict[str, Any]]:
    """Return what the options of a choice mean to the native core, by knob and option."""
    study = source.tank.study
    keys: dict[str, tuple[str, Callable[[Study], Any]]] = {
        "faces": ("assembly.faces", _faces),
        "hidden_face_drag": ("assembly.hidden_face_drag", attrgetter("assembly.hidden_share")),
        "magnets": ("interaction.magnets", _pull),
    }
    return {
        "latching": {word: number for number, word in enumerate(WORDS["latching"])},
        **{
            name: {
                choice: _meaning(study, key, choice, of) for choice in source.knobs[name].choices
            }
            for name, (key, of) in keys.items()
            if name in source.knobs
        },
    }


def _meaning(study: Study, key: str, choice: Any, of: Callable[[Study], Any]) -> Any:
    """Return what another value means; None where it contradicts the study."""
    try:
        other = apply_overrides(study, {key: choice})
    except InputError:
        return None
    return of(other)


def _faces(study: Study) -> dict[str, Any] | None:
    table = face_table(study.assembly)
    if table is None:
        return None
    return {name: np.asarray(value).ravel().tolist() for name, value in table._asdict().items()}


def _pull(study: Study) -> dict[str, Any] | None:
    pull = block_pull(study)
    if pull is None:
        return None
    tables, oriented, far = pull.tables, pull.tables.oriented, pull.tables.multipoles
    return {
        "reach": tables.reach,
        "lever": tables.lever,
        **tables.stepping._asdict(),
        "near_reach": tables.near_reach,
        "radial": [
            {"what": what, "cells": _doubles(cells), "first": first}
            for what, (cells, first) in tables.radial.items()
        ],
        "oriented": None
        if oriented is None
        else {
            **oriented,
            "coefficient": _doubles(oriented["coefficient"]),
            "angles": oriented["coefficient"].shape[1],
        },
        "multipoles": None
        if far is None
        else {**far._asdict(), "coefficient": list(far.coefficient)},
    }


def _motion(source: PlaySource) -> dict[str, Any]:
    """Return the recording's steps and how the camera saw them; of none what steps are made of."""
    window, recording = source.motion, source.recording
    found: dict[str, Any] = {"interval": window.interval, "recording": None}
    if recording is not None:
        steps = recording.steps
        found["recording"] = {
            "points": _doubles(steps.points),
            "length_edge": steps.length_edge.tolist(),
            "angle_edge": steps.angle_edge.tolist(),
            "noise": recording.camera.position_noise,
            "quantum": recording.camera.position_quantum,
            "block_length": usual_block_length(steps_memory_time(steps.points)),
        }
    return found


def _doubles(values: npt.ArrayLike) -> str:
    """Return numbers as text, to the bit."""
    return _deflated(np.ascontiguousarray(values, dtype="<f8").tobytes())


def _deflated(content: bytes) -> str:
    return base64.b64encode(zlib.compress(content, 9)).decode("ascii")
