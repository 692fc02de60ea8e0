"""One damaged file, given to the functions that `driftwalk info` and `driftwalk flow` call."""

from __future__ import annotations

import os
import random
import shutil
import time
import traceback
import warnings
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import mutate
from mutate_netcdf import damage
from mutate_zip import MARK, inside_zip
from seeds import Seed

from driftwalk.cli.inputs.flow_file import describe_field, read_flow_file
from driftwalk.cli.main import load_command
from driftwalk.cli.options.recording import RecordingOptions
from driftwalk.conditions import require_motion
from driftwalk.core.errors import InputError
from driftwalk.flow import extract_flow
from driftwalk.record import describe
from driftwalk.schema.check import check_dataset

LONGEST_S = 3.0
"""Processor time of a file; one of several megabytes may take longer."""
BYTES_A_SECOND = 4 << 20
TANK_M = 0.3
_LONG = (mutate.count_up, mutate.repeat)
"""Damage that makes a file long; rare here, for speed."""
TEXTS = [one for one in mutate.TEXT if one not in _LONG] * 5 + [*_LONG, mutate.compress]
ENDINGS = (".csv", ".txt", ".json", ".vec", ".xml", ".yaml")


@dataclass(frozen=True)
class Case:
    """A damaged file, and how it is read."""

    seed: Seed
    folder: Path
    """A copy of the seed's folder, with the damaged file in it."""
    describes: bool
    """Whether it is described as `driftwalk info` does; rarely, as that takes long."""
    as_flow: bool
    """Whether a recording goes on to be a flow field; more rarely still."""

    @property
    def target(self) -> Path:
        """The damaged file."""
        return self.folder / self.seed.target


@dataclass(frozen=True)
class Verdict:
    """What became of a case."""

    end: str
    """``read`` or ``refused``, for the count; of a finding ``finding``."""
    what: str = ""
    """A finding in words that are the same for the same mistake."""
    detail: str = ""
    """Its traceback or message."""


def make_case(known: list[Seed], place: Path, rng: random.Random) -> Case:
    """Put a damaged file beside whatever else its recording consists of.

    Parameters
    ----------
    known : list of Seed
        One of them is chosen.
    place : Path
        Folder that keeps a copy of each seed's folder.
    rng : Random
        Decides everything.
    """
    seed = rng.choice(known)
    folder = place / seed.name.replace("/", "-")
    if not folder.exists():
        shutil.copytree(seed.folder, folder, ignore=shutil.ignore_patterns("figures"))
    target, valid = folder / seed.target, _content(seed)
    target.unlink(missing_ok=True)
    if seed.is_netcdf and rng.random() < 0.15:
        target.write_bytes(valid)
        damage(target, rng)
    elif valid.startswith(MARK) and rng.random() < 0.7:
        target.write_bytes(inside_zip(valid, rng))
    else:
        damages = TEXTS if target.suffix in ENDINGS else mutate.BYTES
        if target.suffix == ".yaml":
            # Its reader takes seconds for a megabyte, which driftwalk's bound on its size allows.
            damages = [one for one in damages if one not in _LONG]
        target.write_bytes(mutate.mutated(valid, damages, rng))
    further = rng.random()
    return Case(seed, folder, describes=further < 0.3, as_flow=further > 0.95)


@cache
def _content(seed: Seed) -> bytes:
    return (seed.folder / seed.target).read_bytes()


def judge(case: Case) -> Verdict:
    """Read a damaged file, and say whether that is as it has to be."""
    before, names = case.target.read_bytes(), _names(case.folder)
    begin = time.process_time()
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        for quiet in (DeprecationWarning, PendingDeprecationWarning, ResourceWarning):
            warnings.simplefilter("ignore", quiet)
        verdict = _read(case)
    took = time.process_time() - begin
    if case.target.read_bytes() != before or _names(case.folder) != names:
        return Verdict("finding", "the file or its folder is changed")
    if verdict.end == "finding":
        return verdict
    if heard:
        text = str(heard[0].message)
        where = f"{heard[0].filename}:{heard[0].lineno}"
        return Verdict("finding", f"warning: {text[:60]} | {where[-60:]}", text)
    if took > LONGEST_S + len(before) / BYTES_A_SECOND:
        return Verdict("finding", f"slow: {case.seed.folder.name}", f"{took:.2f} s; {verdict}")
    return verdict


def _names(folder: Path) -> list[str]:
    return sorted(name for _, folders, files in os.walk(folder) for name in (*folders, *files))


def _read(case: Case) -> Verdict:
    path, options = _options(case.seed, case.folder)
    try:
        _use(path, options, case)
    except InputError as error:
        said = str(error)
        if "\n" in said or "\r" in said:
            return Verdict("finding", f"several lines | {_where(error)}", said)
        # A file of the same recording may be the one that is wrong.
        if path.name not in said and case.target.name not in said:
            return Verdict("finding", f"no name of the file | {_where(error)}", said)
        return Verdict("refused")
    except BaseException as error:
        what = f"{type(error).__name__}: {str(error)[:60]} | {_where(error)}"
        return Verdict("finding", " ".join(what.split()), traceback.format_exc())
    return Verdict("read")


def _use(path: Path, options: dict[str, Any], case: Case) -> None:
    """Read a file as the commands do."""
    how: RecordingOptions = options["how"]
    if case.as_flow:
        how = replace(how, tank=f"circle:{TANK_M}")
    field = read_flow_file(
        path,
        how,
        frame_interval=options["frame_interval"],
        variables=options["flow_variables"],
    )
    if field is not None:
        describe_field(check_dataset(field))
        return
    recording = check_dataset(how.load(path))
    if case.describes:
        describe(recording)
    if case.as_flow:
        require_motion(recording, body=how.body, where=path)
        try:
            check_dataset(extract_flow(recording, body=how.body))
        except InputError as error:
            # `extract_flow` has a recording, and knows no file.
            raise InputError(f"{path}: {error}") from error


@cache
def _options(seed: Seed, folder: Path) -> tuple[Path, dict[str, Any]]:
    """Return the file, and the options of the seed's first command as the command has them."""
    name, *words = (word.replace("@", str(folder)) for word in seed.commands[0])
    context = load_command(name).make_context(name, words)
    values: dict[str, Any] = dict(context.params)
    fields = RecordingOptions.__dataclass_fields__
    how = RecordingOptions(**{field: values.pop(field) for field in fields})
    return Path(values["recording"]), {**values, "how": how}


def _where(error: BaseException) -> str:
    """Return the innermost line of driftwalk's own that an error passed."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if "/src/driftwalk/" in frame.filename] or [*frames]
    last = own[-1]
    return f"{last.filename.rpartition('driftwalk/')[2]}:{last.lineno}"
