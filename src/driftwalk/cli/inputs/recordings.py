"""Recordings and motions that a command names, read as the study file and the options say."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from driftwalk.cli.inputs.model_source import given_files, load_flow_for
from driftwalk.cli.inputs.other_files import explained
from driftwalk.cli.options.recording import RecordingOptions
from driftwalk.cli.options.study import TANK, StudyOptions, option_name
from driftwalk.cli.terminal.output import print_note, print_warnings
from driftwalk.core.errors import InputError
from driftwalk.core.text_files import text_of_name

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.conditions import About, ReadRecordings
    from driftwalk.conditions.reading import Bodies
    from driftwalk.likelihood import EarlierFit
    from driftwalk.model import Study
    from driftwalk.motion import MotionModel


FIT_TANK: Final = 0.5
"""Share of the rim that was visited from which on the tank can be taken from the positions; chosen
by hand."""


def read_for_run(
    paths: Sequence[Path],
    given: StudyOptions,
    how: RecordingOptions,
    *,
    bodies: Bodies = "named",
    before: EarlierFit | None = None,
) -> ReadRecordings:
    """Read the recordings of a fit or a calibration, and make its study.

    Parameters
    ----------
    paths : sequence of Path
        The recordings.
    given : StudyOptions
        The study.
    how : RecordingOptions
        How to read them.
    bodies : {"named", "all"}
        Which bodies they keep where one is named.
    before : EarlierFit, optional
        Of glued blocks, the fit of one block, whose tank and law are those of the study.

    Raises
    ------
    InputError
        As `driftwalk.conditions.read_recordings`.
    """
    from driftwalk.conditions import read_recordings

    study = given.study()
    if before is not None:
        from driftwalk.likelihood import glued_study

        study = glued_study(study, before.fit)
    said = given.states_tank or how.tank is not None or before is not None
    with explained():
        return read_recordings(
            paths,
            study,
            how.arguments(),
            tank="stated" if said else "unsaid",
            body=how.body,
            bodies=bodies,
        )


def read_for_models(
    path: Path,
    flow: Path | None,
    given: StudyOptions,
    how: RecordingOptions,
    models: Sequence[str | MotionModel],
) -> tuple[dict[str, Any], Callable[[], None]]:
    """Read one recording, and the flow field where one is given, for a run that simulates models.

    Returns what the run's work is made of, by its keywords; and what says, when the run begins,
    which body and tank it takes. All bodies are kept where a model feels the others.

    Raises
    ------
    InputError
        As `read_for_run`, and when the flow field cannot be read.
    """
    from driftwalk.conditions import sound_track
    from driftwalk.motion import feels_others

    others = any(map(feels_others, models))
    read = read_for_run([path], given, how, bodies="all" if others else "named")
    recording, study = read.trajectories[0], read.study
    about: About = "block" if "block" in models else "tank"
    _, warnings = sound_track(recording, read.body)
    work = {
        "recording": recording,
        "study": study,
        "flow": None if flow is None else load_flow_for(flow, study),
        "body": read.body if others else how.body,
        "inputs": given_files(recording=path, flow=flow, study=given.file),
    }
    return work, opening_note(study, given, how=how, about=about, warnings=warnings)


def words_to_fit(trajectory: xr.Dataset, described: Mapping[str, Any] | None = None) -> list[str]:
    """Return the options that a fit needs besides those with which a recording was read.

    Parameters
    ----------
    trajectory : xarray.Dataset
        The recording.
    described : mapping, optional
        What `driftwalk.describe` says of it; found where it is needed, which takes its time.

    Returns
    -------
    list of str
        A body where there are several. Where nothing states the tank, ``--tank fit`` if the
        positions show it; otherwise, if the default one does not hold them, ``--tank
        DIAMETER``, which only the user can fill in.
    """
    from driftwalk.conditions import require_inside
    from driftwalk.model import Study
    from driftwalk.record import describe
    from driftwalk.schema import body_names

    names = body_names(trajectory)
    words = ["--body", names[0]] if len(names) > 1 else []
    if "arena" in trajectory.attrs:
        return words
    found = described if described is not None else describe(trajectory)
    circle = found["bodies"][names[0]]["circle_of_centers"]
    if circle and circle["sectors_visited_share"] >= FIT_TANK:
        return [*words, "--tank", "fit"]
    try:
        require_inside(Study(), trajectory, names[0])
    except InputError:
        return [*words, "--tank", "DIAMETER"]
    return words


def opening_note(
    study: Study,
    given: StudyOptions,
    *,
    about: About,
    how: RecordingOptions | None = None,
    otherwise: str = "recording",
    warnings: Sequence[str] = (),
) -> Callable[[], None]:
    """Return what says, when a run begins, which body and tank it takes, and who stated them.

    Parameters
    ----------
    study : Study
        As the run is made with it.
    given : StudyOptions
        The options and the study file.
    about : {"tank", "block", "simulation"}
        As in `driftwalk.conditions.unstated_warning`.
    how : RecordingOptions, optional
        How the recording is read.
    otherwise : str
        Who stated what neither an option nor the study file does.
    warnings : sequence of str
        What to know before the work, which may take hours.
    """
    from driftwalk.conditions import is_stated
    from driftwalk.model import Study, load_study

    file = Study() if given.file is None else load_study(given.file)
    # Keys that another option states along with its own.
    also = {"block.depth_m": "block.depth", "block.side_m": "block.shape"}

    def stated(key: str, text: str) -> str:
        option = next((one for one in (key, also.get(key)) if one in given.overrides), None)
        if key == TANK and how is not None and how.tank is not None:
            source = "--tank"
        elif option is not None:
            source = option_name(option, keys=given.keys)
        elif is_stated(file, key):
            source = str(given.file)
        else:
            source = otherwise if is_stated(study, key) else "default"
        return f"{text} ({source})"

    block, forces = study.block, study.forces
    depth_cm = 100 * block.wetted_depth_m(study.water.density_kg_m3)
    texts = {"tank.diameter_m": f"tank: {study.tank.describe()}"}
    if about != "tank":
        texts |= {
            "block.side_m": block.described,
            "block.mass_kg": f"mass {1e3 * block.mass_kg:.4g} g",
            "block.depth_m": f"wetted depth {depth_cm:.4g} cm",
        }
    if about == "simulation":
        texts["forces.drag_coefficient"] = f"C_d {forces.drag_coefficient:.4g}"
        texts["forces.force_std_N"] = f"σ_F {1e3 * forces.force_std_N:.4g} mN"
    if about != "tank":
        every = f"{1e3 * forces.force_interval_s:g} ms"
        texts["forces.force_interval_s"] = f"force redrawn every {every}"
    line = "; ".join(stated(key, text) for key, text in texts.items())

    def say() -> None:
        print_note(line)
        print_warnings(warnings)

    return say


def load_motion(path: Path, how: RecordingOptions) -> xr.Dataset:
    """Load a `trajectory` from a recording, or from a file that `driftwalk simulate` wrote.

    Parameters
    ----------
    path : Path
        The file.
    how : RecordingOptions
        How to read a recording, and which replicate of a simulation; a simulation says all else of
        itself.

    Raises
    ------
    InputError
        When the file cannot be read, has no such replicate, or the body never moves.
    """
    from driftwalk.conditions import require_motion

    simulated = load_simulation(path, replicate=how.replicate or 0)
    if simulated is not None:
        return simulated
    # The replicate is that of the other motion.
    recording = replace(how, replicate=None).load(path)
    require_motion(recording, body=how.body, where=path)
    return recording


def load_simulation(path: Path, *, replicate: int = 0) -> xr.Dataset | None:
    """Load a `trajectory` from a file that `driftwalk simulate` wrote; None of any other file.

    Parameters
    ----------
    path : Path
        The file.
    replicate : int
        Which replicate, counted from 0.

    Raises
    ------
    InputError
        When it has no such replicate.
    """
    simulation = open_kind(path, "simulation")
    if simulation is None:
        return None
    count = simulation.sizes["replicate"]
    if not 0 <= replicate < count:
        raise InputError(
            f"{path}: no replicate {replicate}; it has {count}, counted from 0 (--replicate)"
        )
    chosen = simulation[["x", "y", "theta"]].isel(replicate=replicate, drop=True)
    return chosen.assign_attrs(kind="trajectory", source=text_of_name(path.name), simulated="yes")


def open_kind(path: Path, kind: str) -> xr.Dataset | None:
    """Return the dataset of this kind that a file of driftwalk holds, None of any other file."""
    from driftwalk.schema.check import check_contents
    from driftwalk.schema.stores.netcdf import kind_of_file, open_netcdf

    # Damaged, or no NetCDF: the loaders of recordings say what is wrong.
    if not path.is_file() or kind_of_file(path) != kind:
        return None
    return check_contents(open_netcdf(path), path)
