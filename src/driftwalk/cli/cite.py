"""`driftwalk cite`: what to cite for a run, and the line that says what was computed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path, PurePath
from typing import Annotated, Any

from driftwalk.cli.options.shared_types import Json, argument, flag
from driftwalk.cli.terminal.output import print_json, print_warnings, printable
from driftwalk.core.errors import InputError
from driftwalk.core.files.run_layout import MANIFEST_FILE, faults_of, state_of
from driftwalk.core.provenance import read_manifest, refuse_other_version
from driftwalk.schema.answers.citation import bibtex, citation, methods_used
from driftwalk.schema.check import kind_name, require_kind
from driftwalk.schema.runs import kind_of_folder
from driftwalk.schema.stores.netcdf import is_netcdf, open_netcdf


def cite(
    run: Annotated[Path, argument("RUN", "Directory of a finished run, or a simulation (.nc).")],
    bibtex_entries: bool = flag("--bibtex", "Print the program and the paper for BibTeX."),
    json: Json = False,
) -> None:
    """Say what to cite for a run: the program, what it computed, and the methods that it used.

    The line "computed" names the version, the inputs with their hashes and the seeds: with it
    others can reproduce the numbers. Only methods that this run used are listed.
    """
    found = _of_file(run) if run.is_file() else _of_run(run)
    if json:
        print_json({**found, "bibtex": bibtex(found["version"])})
    elif bibtex_entries:
        print(printable(bibtex(found["version"])), end="")
    else:
        print(printable(f"cite      {citation(found['version'])}"))
        print(printable(f"computed  {found['computed']}"))
        for method in found["methods"]:
            print(f"method    {method['what']}: {method['work']}.")


def _of_run(folder: Path) -> dict[str, Any]:
    if state_of(folder) != "finished":
        raise InputError(
            f"{folder} is not the directory of a finished run: there is nothing to cite yet"
        )
    manifest = read_manifest(folder / MANIFEST_FILE)
    refuse_other_version(folder, manifest)
    print_warnings(faults_of(folder, unread=True))
    specification = _mapping(manifest.get("specification"))
    version = str(_mapping(manifest.get("software")).get("driftwalk", ""))
    results = [path.name for path in folder.iterdir() if path.is_file()]
    kind = kind_of_folder(folder, specification)
    methods = [] if kind is None else methods_used(kind.methods, results, specification)
    parts = [
        f"driftwalk {version}",
        _model(specification, manifest),
        *_inputs(manifest),
        _seeds(_mapping(manifest.get("seeds"))),
        f"finished {str(manifest.get('finished_utc', ''))[:10]}",
        f"run {str(manifest.get('fingerprint', ''))[:16]}",
    ]
    return {
        "version": version,
        "command": manifest.get("command"),
        "computed": "; ".join(parts) + ".",
        "seeds": manifest.get("seeds"),
        "fingerprint": manifest.get("fingerprint"),
        "methods": [{"what": one.what, "work": one.work} for one in methods],
    }


def _of_file(path: Path) -> dict[str, Any]:
    from driftwalk import __version__

    if not is_netcdf(path):
        raise InputError(f"{path} is neither a run directory nor a file of driftwalk")
    found = open_netcdf(path)
    kind = kind_name(found) or "of no kind"
    attrs = require_kind(
        found,
        "simulation",
        otherwise=f"{path} is a dataset '{kind}': cite the run directory that it lies in, or a "
        "simulation",
    ).attrs
    seed = int(attrs["seed"])
    model = str(attrs.get("model", "the block of the paper"))
    if "drag_coefficient" in attrs:
        drag, force = float(attrs["drag_coefficient"]), 1e3 * float(attrs["force_std_N"])
        model += f", C_d = {drag:.6g}, σ_F = {force:.6g} mN"
    return {
        "version": __version__,
        "command": None,
        "computed": f"driftwalk {__version__}; simulation of {model}; seed {seed}.",
        "seeds": {"simulation": seed},
        "fingerprint": None,
        "methods": [],
    }


def _model(specification: Mapping[str, Any], manifest: Mapping[str, Any]) -> str:
    model = specification.get("model")
    if isinstance(model, str):
        return f"model {model}"
    if isinstance(model, Mapping) and isinstance(model.get("name"), str):
        return f"model {model['name']}"
    models = specification.get("models")
    if isinstance(models, list):
        names = [str(_mapping(one).get("name", "of a user")) for one in models]
        return f"models {', '.join(names)}"
    block = _mapping(_mapping(manifest.get("study")).get("block"))
    sides = [
        f"{block[key]:g}" for key in ("side_m", "width_m") if isinstance(block.get(key), float)
    ]
    if (shape := block.get("shape", "square")) != "square":
        return f"a body of shape '{shape}' in the model of the paper, {' x '.join(sides)} m"
    return f"the block of the paper, {sides[0]} m wide" if sides else "the block"


def _inputs(manifest: Mapping[str, Any]) -> list[str]:
    return [
        f"{role} {PurePath(str(facts.get('path', ''))).name} "
        f"(SHA-256 {str(facts.get('sha256', ''))[:16]})"
        for role, facts in _mapping(manifest.get("inputs")).items()
        if isinstance(facts, Mapping)
    ]


def _seeds(seeds: Mapping[str, Any]) -> str:
    words = ", ".join(f"{name} {seed}" for name, seed in seeds.items())
    return f"seed {words}" if words else "no random numbers in the estimate"


def _mapping(value: Any) -> Mapping[str, Any]:
    return value if isinstance(value, Mapping) else {}
