"""Who may import whom, and what is imported only inside functions."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

SOURCE = Path(__file__).resolve().parents[2] / "src" / "driftwalk"

GROUND = frozenset({"core", "_core", "schema"})
# For each folder, the others that it may import; ARCHITECTURE.md shows their ranks.
MAY_IMPORT: dict[str, frozenset[str]] = {
    "core": frozenset({"_core"}),
    "schema": frozenset({"core", "_core"}),
    "record": GROUND,
    "flow": GROUND,
    "model": GROUND,
    "comparison": GROUND,
    "sweep": GROUND,
    # `simulation`, with what it takes, for the probe: the same bits on every worker.
    "cluster": GROUND | {"sweep", "simulation", "model", "flow"},
    "simulation": GROUND | {"model"},
    # `record` for reading a recording, and for steps that no body can make.
    "conditions": GROUND | {"record", "model", "flow", "simulation"},
    "motion": GROUND | {"conditions", "simulation", "comparison", "model"},
    "calibration": GROUND
    | {"conditions", "motion", "simulation", "comparison", "flow", "model", "sweep"},
    # `calibration` for the check of a fit: how far simulated steps are from the recording's.
    "likelihood": GROUND
    | {"conditions", "motion", "simulation", "comparison", "flow", "model", "sweep"}
    | {"calibration"},
    "assembly": GROUND | {"simulation", "comparison", "flow", "model", "sweep"},
    # `assemble` for the observer: what is seen is classified by the rules of simulated runs.
    "track": GROUND | {"record", "model", "assembly"},
    "datasets": GROUND | {"record", "flow", "model", "comparison", "sweep", "simulation"},
    "plot": GROUND,
    "figures": GROUND | {"plot"},
    "page": GROUND | {"plot"},
    "runs": GROUND
    | {"flow", "model", "sweep", "conditions", "motion", "calibration", "likelihood", "assembly"}
    | {"plot", "figures"},
    "export": GROUND
    | {"record", "flow", "model", "simulation", "conditions", "assembly"}
    | {"runs", "plot", "figures"},
    "notebook": GROUND
    | {"record", "flow", "model", "comparison", "simulation", "motion", "conditions"}
    | {"assembly", "calibration", "likelihood", "page", "runs"},
    # `track` for its live server, through which the playground's tank can be watched.
    "viewer": GROUND
    | {"record", "flow", "model", "comparison", "simulation", "conditions", "motion"}
    | {"assembly", "track", "plot", "page"},
    "cli": GROUND
    | {"record", "flow", "model", "comparison", "sweep", "simulation", "motion", "conditions"}
    | {
        "assembly",
        "calibration",
        "cluster",
        "likelihood",
        "track",
        "datasets",
        "plot",
        "figures",
        "page",
    }
    | {"runs", "viewer", "export"},
}
HEAVY = frozenset({"xarray", "scipy", "pandas", "cv2", "matplotlib", "dask", "optuna", "h5netcdf"})
# The extra of the server: in one module alone, which is imported when a server is started.
SERVER = frozenset({"fastapi", "starlette", "uvicorn", "websockets"})
SERVER_MODULE = SOURCE / "viewer" / "app.py"
# `driftwalk.core` and `driftwalk.schema` are used by module; a stage by the names in its `__all__`.
BY_MODULE = GROUND


class Import(NamedTuple):
    file: Path
    line: int
    module: str
    names: tuple[str, ...]
    at_module_level: bool
    for_types_only: bool

    @property
    def folder(self) -> str:
        parts = self.file.relative_to(SOURCE).parts
        return parts[0] if len(parts) > 1 else ""

    def __str__(self) -> str:
        return f"{self.file.relative_to(SOURCE)}:{self.line} imports {self.module}"


def imports_of(file: Path) -> Iterator[Import]:
    tree = ast.parse(file.read_text(encoding="utf-8"))
    yield from walk(file, tree.body, at_module_level=True, for_types_only=False)


def walk(
    file: Path, body: list[ast.stmt], *, at_module_level: bool, for_types_only: bool
) -> Iterator[Import]:
    for node in body:
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield Import(file, node.lineno, alias.name, (), at_module_level, for_types_only)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}:{node.lineno}: a relative import"
            names = tuple(alias.name for alias in node.names)
            module = node.module or ""
            yield Import(file, node.lineno, module, names, at_module_level, for_types_only)
        else:
            inside = at_module_level and not isinstance(
                node, (ast.FunctionDef, ast.AsyncFunctionDef)
            )
            typing_only = for_types_only or (
                isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING")
            )
            for name in ("body", "orelse", "finalbody"):
                inner = getattr(node, name, [])
                if isinstance(inner, list):
                    statements = [item for item in inner if isinstance(item, ast.stmt)]
                    yield from walk(
                        file, statements, at_module_level=inside, for_types_only=typing_only
                    )
            for handler in getattr(node, "handlers", []):
                yield from walk(
                    file, handler.body, at_module_level=inside, for_types_only=typing_only
                )


@cache
def all_imports() -> list[Import]:
    """Return the import statements of the package; only a process that looks at them reads it."""
    return [found for file in sorted(SOURCE.rglob("*.py")) for found in imports_of(file)]


def stages_imported(found: Import) -> set[str]:
    """Return the folders of driftwalk that an import statement reaches."""
    if found.module == "driftwalk":
        return {name for name in found.names if name != "__version__"}
    if found.module.startswith("driftwalk."):
        return {found.module.split(".")[1]}
    return set()


def test_every_folder_has_a_rank() -> None:
    folders = {path.name for path in SOURCE.iterdir() if path.is_dir()} - {"__pycache__"}
    assert folders <= MAY_IMPORT.keys(), folders - MAY_IMPORT.keys()


@pytest.mark.slow
def test_walk_finds_imports() -> None:
    """The walk itself can fail: a known import inside a function, and one for types only."""
    found = [entry for entry in all_imports() if entry.file == SOURCE / "schema" / "check.py"]
    assert any(e.module == "xarray" and e.for_types_only for e in found)
    assert any(e.module == "xarray" and not e.at_module_level for e in found)
    assert any(e.module == "driftwalk.core.errors" and e.at_module_level for e in found)


@pytest.mark.parametrize("folder", sorted(MAY_IMPORT))
def test_folder_imports_only_from_lower_ranks(folder: str) -> None:
    allowed = MAY_IMPORT[folder] | {folder}
    wrong = [
        str(found)
        for found in all_imports()
        if found.folder == folder and not stages_imported(found) <= allowed
    ]
    assert not wrong


def test_command_line_uses_public_names() -> None:
    wrong = []
    for found in all_imports():
        stages = stages_imported(found) - BY_MODULE - {"cli"}
        if found.folder != "cli" or not stages or found.for_types_only:
            continue
        if found.module.count(".") > 1 or any(name.startswith("_") for name in found.names):
            wrong.append(str(found))
    assert not wrong


SUBCLASSES = frozenset({"notebook/result.py"})
"""Modules that need a heavy package at their top, because a class of theirs derives from one."""


def test_heavy_packages_are_imported_inside_functions() -> None:
    wrong = [
        str(found)
        for found in all_imports()
        if found.module.split(".")[0] in HEAVY
        and found.at_module_level
        and not found.for_types_only
        and str(found.file.relative_to(SOURCE)) not in SUBCLASSES
    ]
    assert not wrong


@pytest.mark.parametrize("name", sorted(SUBCLASSES))
def test_a_subclass_of_a_heavy_class_is_imported_inside_functions(name: str) -> None:
    module = "driftwalk." + name.removesuffix(".py").replace("/", ".")
    importers = [found for found in all_imports() if found.module == module]
    assert importers
    assert not [str(found) for found in importers if found.at_module_level]


def test_the_server_is_imported_by_one_module() -> None:
    found = [e for e in all_imports() if e.module.split(".")[0] in SERVER and e.at_module_level]
    assert {entry.file for entry in found} == {SERVER_MODULE}


def test_stages_do_not_import_the_command_line_or_each_other_in_a_ring() -> None:
    """The table itself has no ring: every folder's imports can be put in order."""
    ordered: list[str] = ["_core"]
    remaining = dict(MAY_IMPORT)
    while remaining:
        ready = [name for name, needs in remaining.items() if needs <= set(ordered)]
        assert ready, f"a ring among {sorted(remaining)}"
        for name in ready:
            ordered.append(name)
            del remaining[name]
    assert "cli" not in frozenset().union(*MAY_IMPORT.values())


def test_no_module_imports_a_private_name_of_another() -> None:
    wrong = [
        f"{found}: {name}"
        for found in all_imports()
        if found.module.startswith("driftwalk")
        for name in (*found.names, *found.module.split("."))
        if name.startswith("_") and name not in {"_core", "__version__"}
    ]
    assert not wrong


def modules() -> dict[str, Path]:
    """Return every module of the package by its full name."""
    found = {}
    for file in SOURCE.rglob("*.py"):
        parts = ("driftwalk", *file.relative_to(SOURCE).with_suffix("").parts)
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = file
    return found


def rings(needs: dict[str, set[str]]) -> set[str]:
    """Return the modules that are left when those that need no other are taken away, repeatedly."""
    left = dict(needs)
    while ready := [name for name, needed in left.items() if not needed & left.keys()]:
        for name in ready:
            del left[name]
    return set(left)


def test_no_ring_of_imports() -> None:
    """Imports inside functions and for types count: a reader of one file has to read the other."""
    names = modules()
    needs: dict[str, set[str]] = {}
    of_file: dict[Path, list[Import]] = {}
    for found in all_imports():
        of_file.setdefault(found.file, []).append(found)
    for name, file in names.items():
        inits = {name} if file.name == "__init__.py" else set()
        reached = set()
        for found in of_file.get(file, []):
            if found.module.startswith("driftwalk"):
                submodules = {f"{found.module}.{each}" for each in found.names} & names.keys()
                reached |= submodules or ({found.module} & names.keys())
        needs[name] = reached - inits
    assert rings({"a": {"b"}, "b": {"a"}, "c": {"a"}, "d": set()}) == {"a", "b", "c"}
    assert not rings(needs)


MOST_FILES = 20


def test_no_folder_is_a_drawer() -> None:
    """A folder of more files than a reader can take in holds several subjects."""
    folders = {path.parent for path in SOURCE.rglob("*.py")}
    sizes = {str(one.relative_to(SOURCE)): len(list(one.glob("*.py"))) for one in folders}
    assert {name: size for name, size in sizes.items() if size > MOST_FILES} == {}
