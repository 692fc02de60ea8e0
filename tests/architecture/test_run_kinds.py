"""Kinds of runs are dispatched by their declarations alone."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from driftwalk.schema.runs import RUN_KINDS, load_maker
from driftwalk.schema.runs.run_kinds import BUILT_IN

SOURCE = Path(__file__).resolve().parents[2] / "src" / "driftwalk"
ROOMS = {
    "figures": {"figures", "runs"},
    "page": {"page"},
    "live": {"viewer"},
    "answer": {"schema"},
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


def test_no_module_asks_a_dataset_for_its_kind() -> None:
    """`driftwalk.schema` answers: `kind_of` for runs, `kind_name` and `require_kind` for others."""
    wrong = [
        f"{path.relative_to(SOURCE)}:{number}"
        for path in sorted(SOURCE.rglob("*.py"))
        if path.relative_to(SOURCE).parts[0] != "schema"
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1)
        if ASKS.search(line)
    ]
    assert not wrong
    assert ASKS.search('if dataset.attrs.get("kind") == "fit":')


def test_files_of_results_are_named_once() -> None:
    """No two kinds of runs are confused by the file of their result."""
    assert len({kind.file for kind in BUILT_IN}) == len(BUILT_IN)
