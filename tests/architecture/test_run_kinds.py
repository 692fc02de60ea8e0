"""Kinds of runs are dispatched by their declarations alone."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from driftwalk.schema.runs import RUN_KINDS, load_maker
from driftwalk.schema.runs.run_kinds import BUILT_IN

SOURCE = Path(__file__).resolve().parents[2] / "src" / "driftwalk"
ROOMS = {
    "figures": {"figures", "runs"},
    "page": {"page"},
    "live": {"viewer"},
    "answer": {"schema", "assembly"},
    "flow": {"likelihood"},
}
"""Where what a declaration names lies: in the room that reads it, or in one below."""
ASKS = re.compile(r"""attrs(\[|\.get\()["']kind["']""")


@pytest.mark.parametrize("kind", BUILT_IN, ids=lambda kind: kind.name)
def test_what_a_declaration_names_is_there(kind) -> None:
    assert RUN_KINDS[kind.name] is kind
    for part, rooms in ROOMS.items():
        maker = getattr(kind, part)
        if maker is not None:
            assert maker.partition(":")[0].split(".")[1] in rooms, maker
            assert callable(load_maker(maker))


@pytest.mark.parametrize("kind", BUILT_IN, ids=lambda kind: kind.name)
def test_every_kind_has_an_answer_and_methods_to_cite(kind) -> None:
    assert kind.answer is not None
    assert kind.methods or kind.name == "model_recovery"
    if isinstance(kind.following, str):
        assert callable(load_maker(kind.following))


def test_no_module_asks_a_dataset_for_its_kind() -> None:
    """`kind_of` answers for runs, `find_kind` for datasets, and `require_kind` refuses others."""
    wrong = [
        f"{name}:{number}"
        for name, text in modules()
        if name not in ("schema/check.py", "schema/kinds/__init__.py")
        for number, line in enumerate(text.splitlines(), start=1)
        if ASKS.search(line)
    ]
    assert not wrong
    assert ASKS.search('if dataset.attrs.get("kind") == "fit":')


def test_no_module_compares_a_kind_with_a_name() -> None:
    """What depends on the kind is a property of its declaration."""
    wrong = [f"{name}:{line}" for name, text in modules() for line in compared_kinds(text)]
    assert not wrong
    asked = ("kind_name(a) == 'fit'", "k = kind_name(a)\nk not in ('a', 'b')", "a.kind.name == 'b'")
    assert all(compared_kinds(text) for text in asked)


def modules() -> Iterator[tuple[str, str]]:
    """Yield the modules outside of the registry with their texts."""
    for path in sorted(SOURCE.rglob("*.py")):
        name = path.relative_to(SOURCE).as_posix()
        if not name.startswith("schema/runs/"):
            yield name, path.read_text(encoding="utf-8")


def compared_kinds(text: str) -> list[int]:
    """Return the lines that compare the kind of a dataset or a run with a name."""
    tree = ast.parse(text)
    asked = {
        target.id
        for node in ast.walk(tree)
        if isinstance(node, ast.Assign) and "kind_name(" in ast.unparse(node.value)
        for target in node.targets
        if isinstance(target, ast.Name)
    }

    def is_kind(node: ast.expr) -> bool:
        said = ast.unparse(node)
        return said in asked or bool(re.search(r"\bkind_name\(|\bkind\.name$", said))

    def is_name(node: ast.expr) -> bool:
        parts = node.elts if isinstance(node, ast.Tuple | ast.List | ast.Set) else [node]
        return any(isinstance(one, ast.Constant) and isinstance(one.value, str) for one in parts)

    return [
        node.lineno
        for node in ast.walk(tree)
        if isinstance(node, ast.Compare) and is_kind(node.left) and is_name(node.comparators[0])
    ]


def test_files_of_results_are_named_once() -> None:
    """No two kinds of runs are confused by the file of their result."""
    assert len({kind.file for kind in BUILT_IN}) == len(BUILT_IN)
