"""The study of a piece of work: statements of the user, tank and block of the recording."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple

import numpy as np

from driftwalk.conditions.refuse import prefix_of
from driftwalk.core.errors import InputError
from driftwalk.core.units import in_percent
from driftwalk.flow.arena import outline_of
from driftwalk.model import Study, Tank, apply_overrides, parse_study
from driftwalk.schema import body_track
from driftwalk.schema.answers.facts import fitted_value
from driftwalk.schema.answers.parts import undetermined
from driftwalk.schema.check import kind_name
from driftwalk.schema.tracking_noise import noise_reach
from driftwalk.schema.trajectory import read_arena

if TYPE_CHECKING:
    import xarray as xr


OUTLINE: Final = ("shape", "diameter_m", "width_m", "height_m", "vertices_m")
"""Keys of a tank that state its outline; the others are about its wall."""


class TankPolicy(NamedTuple):
    """When a stated tank cannot be that of a recording."""

    most_outside: float = 0.01
    """Share of positions outside the tank, farther than noise takes them, from which on the tank
    cannot be right; chosen by hand."""


TANK: Final = TankPolicy()


def study_in_arena(study: Study, recording: xr.Dataset) -> Study:
    """Return the study with the recording's arena as its tank, the wall's properties kept.

    Parameters
    ----------
    study : Study
        Its [tank] stays where the recording has no arena.
    recording : xarray.Dataset
        A `trajectory`, read with an arena or without.

    Returns
    -------
    Study
        The same study where the recording has no arena.

    Examples
    --------
    >>> import driftwalk as dw
    >>> wide = dw.apply_overrides(dw.Study(), {"tank.diameter_m": 1.0})
    >>> study_in_arena(wide, dw.tank30_recording()).tank.diameter_m
    0.3
    """
    arena = recording.attrs.get("arena")
    if arena is None:
        return study
    tank = Tank.from_arena(arena)
    given = {f"tank.{key}": getattr(tank, key) for key in OUTLINE if getattr(tank, key) is not None}
    return apply_overrides(study, given)


def require_inside(study: Study, recording: xr.Dataset, body: str | None) -> None:
    """Refuse a tank that does not hold the recorded positions.

    The camera's noise shows a body at the wall beyond it: by four standard deviations at most, of
    the study's noise or of the one that is estimated (`noise_reach` of `schema.tracking_noise`). A
    simulated recording in its own tank is not looked at: the body kept to it.

    Parameters
    ----------
    study : Study
        Its tank.
    recording : xarray.Dataset
        A `trajectory`.
    body : str or None
        The body, where there are several.

    Raises
    ------
    InputError
        When more than 1 % of the positions lie farther outside than noise takes them.

    Examples
    --------
    >>> import driftwalk as dw
    >>> require_inside(dw.Study(), dw.tank30_recording(), None)
    """
    tank = study.tank
    own = study_in_arena(study, recording).tank
    if "arena" in recording.attrs and recording.attrs.get("simulated") == "yes" and own == tank:
        return
    track = body_track(recording, body)
    outline = outline_of(tank.to_arena())
    beyond = -outline.depth(track.x, track.y)
    if np.mean(beyond > 0.0) <= TANK.most_outside:
        return
    x_min, y_min, x_max, y_max = outline.bounds
    stated = study.observation.position_noise_m
    noise = None if isinstance(stated, str) else stated
    reach = noise_reach(track, noise, size=min(x_max - x_min, y_max - y_min))
    share = float(np.mean(beyond > reach))
    if share > TANK.most_outside:
        raise InputError(
            f"{in_percent(share)} of the positions lie outside the tank, a {tank.describe()} "
            f"about the origin, farther than noise takes them ({1e3 * reach:.2g} mm): the "
            f"recording spans x {track.x.min():.3g} to {track.x.max():.3g} m, y "
            f"{track.y.min():.3g} to {track.y.max():.3g} m; "
            "state the tank with `tank.diameter_m`, `tank` of `load` or [tank] in a study file"
        )


About = Literal["tank", "block", "simulation"]
"""Work whose numbers the tank decides, the block in it too, or its forces as well."""
FORCE_KEYS: Final = {"drag_coefficient": "drag_coefficient", "force_std_N": "force_std"}
"""Keys of [forces] that every estimate has, and its parameters that they hold."""
LAW_KEYS: Final = {
    "added_mass_share": "added_mass_share",
    "linear_drag_kg_s": "linear_drag",
    "drag_power": "drag_power",
    "force_memory_s": "force_memory",
}
"""Keys of [forces], and the parameters of a fit that they hold."""
_BLOCK_ATTRIBUTES: Final = {
    "shape": ("block_shape", "", "shape", "`block.shape`"),
    "width_m": ("block_width_m", "m", "width", "`block.shape`"),
    "side_m": ("block_side_m", "m", "side", "`block` when the recording is loaded"),
    "mass_kg": ("block_mass_kg", "kg", "mass", "`block.mass_kg`"),
    "depth_m": ("block_depth_m", "m", "depth", "`block.depth`"),
    "depth": ("block_depth", "", "depth", "`block.depth`"),
}
"""Keys of [block] that a recording may state, with its attribute."""


def study_for(
    recordings: Sequence[xr.Dataset],
    study: Study | None = None,
    overrides: Mapping[str, Any] | None = None,
    *,
    body: str | None = None,
    needs_tank: bool = True,
) -> Study:
    """Return the study that work on recordings is done with; each fact is stated once.

    Parameters
    ----------
    recordings : sequence of xarray.Dataset
        `trajectory` datasets of one block in one tank. The tank and the block that they were loaded
        with are those of the study.
    study : Study, optional
        Default: the paper's.
    overrides : mapping, optional
        Over the study, from ``"section.key"`` to the value.
    body : str, optional
        The body, where there are several.
    needs_tank : bool
        Whether the work takes place in the tank, so that a default one has to hold the positions,
        too. A tank that is stated always has to.

    Returns
    -------
    Study
        With the recordings' tank and block; with the force interval of a simulated one where the
        study states none.

    Raises
    ------
    InputError
        When a recording and the study, or two recordings, state two different tanks or blocks, or
        more than 1 % of the positions lie outside the tank.

    Examples
    --------
    >>> import driftwalk as dw
    >>> dw.conditions.study_for([dw.tank30_recording()]).tank.diameter_m
    0.3
    """
    chosen = apply_overrides(study if study is not None else Study(), overrides or {})
    # A fact that is stated already, by the study or by an earlier recording, has to be the same.
    tank = is_stated(chosen, "tank.diameter_m")
    block: set[str] = set(chosen.block.model_fields_set)
    fitted = False
    for recording in recordings:
        # A circle that is fitted to the positions states no tank: another recording has another.
        if not (fitted and is_fitted(recording)):
            own = study_in_arena(chosen, recording)
            same = all(getattr(own.tank, key) == getattr(chosen.tank, key) for key in OUTLINE)
            if tank and not same:
                raise InputError(
                    f"{prefix_of(recording)}the recording is in a {own.tank.describe()}, and the "
                    f"study says a {chosen.tank.describe()}: state the tank once, `tank` when the "
                    "recording is loaded"
                )
            chosen = own
        fitted = fitted or is_fitted(recording)
        chosen = study_of_block(chosen, recording, stated=block)
        every = recording.attrs.get("force_interval_s")
        if every is not None and not is_stated(chosen, "forces.force_interval_s"):
            chosen = apply_overrides(chosen, {"forces.force_interval_s": float(every)})
        tank = tank or "arena" in recording.attrs
        block |= {key for key, (name, *_) in _BLOCK_ATTRIBUTES.items() if name in recording.attrs}
    for recording in recordings if tank or needs_tank else ():
        require_inside(chosen, recording, body)
    return chosen


def study_of_block(
    study: Study, recording: xr.Dataset, *, stated: Collection[str] | None = None
) -> Study:
    """Return the study with the block of a recording; refuse one that is not the stated block.

    Parameters
    ----------
    study : Study
        The study.
    recording : xarray.Dataset
        A `trajectory`.
    stated : collection of str, optional
        The keys of [block] that are stated; by default those that the study states.

    Examples
    --------
    >>> import driftwalk as dw
    >>> study_of_block(dw.Study(), dw.tank30_recording()).block.mass_kg
    0.0116
    """
    known = set(study.block.model_fields_set if stated is None else stated)
    added: dict[str, Any] = {}
    for key, (name, unit, word, way) in _BLOCK_ATTRIBUTES.items():
        if name not in recording.attrs:
            continue
        own, ours = recording.attrs[name], getattr(study.block, key)
        if unit:
            own = float(own)
        # Up to rounding, two numbers are the same statement.
        is_same = own == ours or (unit and ours is not None and abs(own - ours) <= 1e-9 * ours)
        same_fact = {"depth", "depth_m"} if word == "depth" else {key}
        if known.isdisjoint(same_fact):
            added[f"block.{key}"] = ours if is_same else own
        elif not is_same:
            # A depth is stated by either of two keys.
            stated_by = next(one for one in _BLOCK_ATTRIBUTES if one in same_fact & known)
            stated = f"{getattr(study.block, stated_by)} {_BLOCK_ATTRIBUTES[stated_by][1]}"
            raise InputError(
                f"{prefix_of(recording)}the recording is of a block of {word} "
                f"{f'{own} {unit}'.rstrip()}, and the study says {stated.rstrip()}: state the "
                f"{word} once, {way}"
            )
    # At once: a rectangle is not valid by its shape alone.
    return apply_overrides(study, added)


def block_attributes(study: Study) -> dict[str, Any]:
    """Return the attributes by which a recording states its block: what the study states of it.

    Parameters
    ----------
    study : Study
        Its [block].

    Examples
    --------
    >>> import driftwalk as dw
    >>> block_attributes(dw.apply_overrides(dw.Study(), {"block.shape": "disc:4cm"}))
    {'block_shape': 'disc', 'block_side_m': 0.04}
    """
    return {
        name: getattr(study.block, key)
        for key, (name, *_) in _BLOCK_ATTRIBUTES.items()
        if key in study.block.model_fields_set and getattr(study.block, key) is not None
    }


def estimated_study(
    found: xr.Dataset, overrides: Mapping[str, Any] | None = None, *, source: str = "study"
) -> Study:
    """Return the study of a fit or a calibration of the block, with the estimates in it.

    Parameters
    ----------
    found : xarray.Dataset
        A `fit` or a `calibration`.
    overrides : mapping, optional
        Over the study, from ``"section.key"`` to the value.
    source : str
        Where the study is from, for an error.

    Returns
    -------
    Study
        With the estimated drag coefficient and stochastic force, under the law of a fit, and with
        the wall where that was estimated.

    Raises
    ------
    InputError
        When the two were not estimated, or the recording does not determine one of them.

    Examples
    --------
    >>> import driftwalk as dw
    >>> fit = dw.fit_motion(dw.tank30_recording())  # doctest: +SKIP
    >>> estimated_study(fit).forces.drag_coefficient  # doctest: +SKIP
    0.393
    """
    stated = overrides or {}
    unknown = undetermined(found)
    for key, name in FORCE_KEYS.items():
        if f"forces.{key}" not in stated and name in unknown:
            raise InputError(
                f"the {kind_name(found)} does not determine {name}: its recording tells too "
                f"little of it; take its flow field alone (`flow`), and state `forces.{key}`"
            )
    estimates = {f"forces.{key}": fitted_value(found, name) for key, name in FORCE_KEYS.items()}
    estimates |= fitted_law(found) | fitted_wall(found)
    study = parse_study(found.attrs["study"], source=source)
    return apply_overrides(study, {**estimates, **stated})


def fitted_law(found: xr.Dataset) -> dict[str, Any]:
    """Return the keys of the section [forces] that say what force law a fit has found.

    Parameters
    ----------
    found : xarray.Dataset
        A `fit`; another kind has the law of its study, and no keys.

    Examples
    --------
    >>> import xarray as xr
    >>> fitted_law(xr.Dataset(attrs={"force_law": "floating body"}, coords={"parameter": []}))
    {'forces.pressure_gradient': True}
    """
    if "force_law" not in found.attrs:
        return {}
    law: dict[str, Any] = {"forces.pressure_gradient": found.attrs["force_law"] == "floating body"}
    known = {str(name) for name in found["parameter"].values}
    for key, name in LAW_KEYS.items():
        if name in known:
            law[f"forces.{key}"] = max(fitted_value(found, name), 0.0)
    # Forces on the cells of a glued body turn it; of one block the lever is a test of the model.
    if "force_lever" in known and "study" in found.attrs and _is_glued(found):
        law["forces.force_lever_m"] = fitted_value(found, "force_lever")
    if "hidden_face_drag_share" in known:
        law["assembly.hidden_face_drag"] = fitted_value(found, "hidden_face_drag_share")
    return law


def _is_glued(found: xr.Dataset) -> bool:
    return len(parse_study(found.attrs["study"]).block.body().cells) > 1


def fitted_wall(found: xr.Dataset) -> dict[str, float]:
    """Return the keys of the section [tank] that say what a fit has found of the wall.

    Parameters
    ----------
    found : xarray.Dataset
        A `fit`; one whose wall was not estimated has no keys.

    Examples
    --------
    >>> import xarray as xr
    >>> fitted_wall(xr.Dataset({"wall_restitution": 0.4, "wall_friction": float("inf")}))
    {'tank.wall_restitution': 0.4, 'tank.wall_friction': 10.0}
    """
    if "wall_friction" not in found:
        return {}
    return {
        "tank.wall_restitution": float(found["wall_restitution"]),
        # With a friction of 10, every contact with the wall sticks.
        "tank.wall_friction": min(float(found["wall_friction"]), 10.0),
    }


def unstated_warning(study: Study, *, about: About) -> str | None:
    """Return the warning about unstated values that decide the results.

    Parameters
    ----------
    study : Study
        As the work is done with it: what a recording states counts as stated.
    about : {"tank", "block", "simulation"}
        Whether the tank alone decides them; mass and side of the block too, to which C_d and σ_F
        belong; or C_d and σ_F as well.

    Returns
    -------
    str or None
        None where all of it is stated.

    Examples
    --------
    >>> import driftwalk as dw
    >>> unstated_warning(dw.Study(), about="tank")[:60]
    'the tank was not stated: the default, a circle of diameter 0'
    >>> study = dw.conditions.study_for([dw.tank30_recording()])
    >>> unstated_warning(study, about="block") is None
    True
    """
    block, forces, tank = study.block, study.forces, study.tank
    force = f"{1e3 * forces.force_std_N:.4g} mN every {1e3 * forces.force_interval_s:.4g} ms"
    decisive = {
        "block.mass_kg": ("mass", f"{1e3 * block.mass_kg:.4g} g"),
        "block.side_m": ("side", f"{100 * block.side_m:.4g} cm"),
        "forces.drag_coefficient": ("drag coefficient", f"{forces.drag_coefficient:.4g}"),
        "forces.force_std_N": ("force", force),
        "tank.diameter_m": ("tank", f"a {tank.describe()}"),
    }
    sections = {"tank": {"tank"}, "block": {"tank", "block"}}.get(about)
    assumed = {
        key: said
        for key, said in decisive.items()
        if (sections is None or key.partition(".")[0] in sections) and not is_stated(study, key)
    }
    if not assumed:
        return None
    names, values = zip(*assumed.values(), strict=True)
    one = len(values) == 1
    were, are = ("was", "the default, {}, is") if one else ("were", "the defaults, {}, are")
    return (
        f"the {_listed(names)} {were} not stated: {are.format(_listed(values))} assumed, and the "
        f"result holds for {'it' if one else 'them'} alone; state "
        + _listed([f"`{key}`" for key in assumed])
    )


def is_stated(study: Study, key: str) -> bool:
    """Return whether a key of a study was stated; of a tank, its outline.

    Parameters
    ----------
    study : Study
        The study.
    key : str
        The key, as ``"section.key"``.

    Examples
    --------
    >>> import driftwalk as dw
    >>> study = dw.apply_overrides(dw.Study(), {"block.side_m": "4cm"})
    >>> is_stated(study, "block.side_m"), is_stated(study, "block.mass_kg")
    (True, False)
    """
    section, _, name = key.partition(".")
    if section == "tank":
        names: Collection[str] = OUTLINE
    else:
        names = ("depth", "depth_m") if key == "block.depth_m" else (name,)
    return not getattr(study, section).model_fields_set.isdisjoint(names)


def _listed(words: Sequence[str]) -> str:
    *first, last = words
    return f"{', '.join(first)} and {last}" if first else last


def is_fitted(recording: xr.Dataset) -> bool:
    """Return whether the arena is the circle that was fitted to the positions."""
    return "radius_is" in read_arena(str(recording.attrs.get("arena_found", "{}")))
