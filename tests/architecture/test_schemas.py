"""Every kind of dataset that the package makes has a schema, and is made through it."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from driftwalk.schema.description import FREE, Kind
from driftwalk.schema.kinds import KINDS

SOURCE = Path(__file__).resolve().parents[2] / "src" / "driftwalk"
OF_WHAT_IS_GIVEN = {
    *("value", "low", "high", "variance"),
    *("estimate", "interval", "coarse_estimate", "first_half_estimate"),
    *("number_value", "departure_estimate", "departure_std"),
    *("profile_value", "searched_estimate", "posterior_sample", "range", "truth"),
    *("node_value", "truth_value"),
    *("check_recorded", "check_median", "check_low", "check_high"),
}
"""Numbers whose unit depends on the input, the output or the parameter."""


@cache
def modules() -> list[tuple[Path, ast.Module]]:
    return [
        (path.relative_to(SOURCE), ast.parse(path.read_text(encoding="utf-8")))
        for path in sorted(SOURCE.rglob("*.py"))
    ]


def said_kinds(tree: ast.Module) -> Iterator[str]:
    """Return the kinds that a module builds: of `build_dataset`, and beside a schema_version."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            if node.func.id == "build_dataset" and isinstance(node.args[0], ast.Constant):
                yield str(node.args[0].value)
        elif isinstance(node, ast.Dict):
            keys = [key.value if isinstance(key, ast.Constant) else None for key in node.keys]
            if "kind" in keys and "schema_version" in keys:
                value = node.values[keys.index("kind")]
                if isinstance(value, ast.Constant):
                    yield str(value.value)


@pytest.mark.slow
def test_what_the_package_makes_has_a_schema_and_no_schema_lies_idle() -> None:
    made = {kind for _, tree in modules() for kind in said_kinds(tree)}
    assert made == set(KINDS)


@pytest.mark.slow
def test_versions_stand_in_the_schemas_alone() -> None:
    """A version that a builder names itself would not rise with its schema."""
    others = [
        str(path)
        for path, tree in modules()
        for node in ast.walk(tree)
        if isinstance(node, ast.Name) and node.id == "SCHEMA_VERSION"
    ]
    assert others == []


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_a_schema_agrees_with_itself(kind: Kind) -> None:
    names = [one.name for one in kind.variables]
    attributes = [one.name for one in kind.attributes]
    assert len(set(names)) == len(names)
    assert len(set(attributes)) == len(attributes)
    assert set(kind.read.split()) <= set(names)
    assert set(kind.read_attributes.split()) <= set(attributes)
    for variable in kind.variables:
        assert set(variable.fixed_dims) <= kind.dimensions.keys()
        assert FREE not in variable.dims.split()[1:]
        # Flags, names and indices count nothing; every other number has a unit, "1" at least.
        if variable.holds == "float":
            assert variable.units is not None or variable.name in OF_WHAT_IS_GIVEN
        if variable.flags:
            assert variable.holds == "int"
            assert variable.units is None
