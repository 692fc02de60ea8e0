"""How examples are read from a page, and compared with what was printed."""

from __future__ import annotations

import pytest

from examples.printed import Numbers, not_printed
from examples.reading import commands_of, read_blocks
from examples.running import edited

TEXT = """Text `$ driftwalk no`.

```console
$ driftwalk fit "a b.csv" \\
    -o fit/   # a remark
drag  0.39   90 % interval 0.3881 to 0.3976
                    # … and more
$ driftwalk study new > study.toml
```

```text
$ not an example
```

```python
x = 1
```
"""


def test_blocks_have_their_lines_and_languages() -> None:
    found = read_blocks("page.md", TEXT)
    assert [(str(block), block.language) for block in found] == [
        ("page.md:3", "console"),
        ("page.md:15", "python"),
    ]
    assert found[1].text == "x = 1\n"


def test_commands_have_their_words_and_lines() -> None:
    fit, new = commands_of(read_blocks("page.md", TEXT)[0].text)
    assert fit.text == 'driftwalk fit "a b.csv" -o fit/'
    assert fit.words == ["driftwalk", "fit", "a b.csv", "-o", "fit/"]
    assert len(fit.shown) == 2
    assert (new.words, new.into) == (["driftwalk", "study", "new"], "study.toml")
    with pytest.raises(ValueError, match="before the first command"):
        commands_of("drag 0.39\n$ driftwalk fit\n")


PRINTED = "drag   0.39\nforce  0.61 mN\nrecord 12 min 3 s (2 h 1 min to 1 h)\nof 5 s, 1 min\n"


@pytest.mark.parametrize(
    ("shown", "numbers", "missing"),
    [
        (["drag 0.39", "  # … and more"], Numbers.SAME, []),
        (["force  0.61 mN  # a remark", "..."], Numbers.SAME, []),
        (["drag 0.40"], Numbers.SAME, ["drag 0.40"]),
        (["force 0.61 mN", "drag 0.39"], Numbers.SAME, ["drag 0.39"]),
        (["drag 0.41"], Numbers.CLOSE, []),
        (["drag 0.42"], Numbers.CLOSE, ["drag 0.42"]),
        (["drags 0.39"], Numbers.CLOSE, ["drags 0.39"]),
        (["drag 0.32"], Numbers.RUNS, []),
        (["drag 0.30"], Numbers.RUNS, ["drag 0.30"]),
        (["drag 7", "force 1e-3 mN"], Numbers.ANY, []),
        (["record 3 min (1 min to 4 h 2 min)", "of 5 min, 1 h, 2 h"], Numbers.ANY, []),
        (["force 0.61 N"], Numbers.ANY, ["force 0.61 N"]),
        (["drag x"], Numbers.ANY, ["drag x"]),
    ],
)
def test_shown_lines_are_looked_for(shown: list[str], numbers: Numbers, missing: list[str]) -> None:
    assert not_printed(shown, PRINTED, numbers) == missing


def test_close_numbers_agree_to_their_last_digits() -> None:
    """A distance of 0.020 is no 0.023, and a size of 1e6 no 1.1e6; what scatters is said."""
    for shown, printed, agree in (
        ("D 0.023", "D 0.020", False),
        ("D 0.022", "D 0.020", True),
        ("n 6.059e-09", "n 6.058e-09", True),
        ("n 6.059e-09", "n 6.062e-09", False),
        ("of 20", "of 22", True),
        ("of 20", "of 23", False),
    ):
        assert (not_printed([shown], printed, Numbers.CLOSE) == []) == agree, shown
    chance = {"KS": 0.005}
    assert not_printed(["KS 0.023"], "KS 0.020", Numbers.SAME, chance) == []
    assert not_printed(["KS 0.023"], "KS 0.017", Numbers.SAME, chance) == ["KS 0.023"]
    assert not_printed(["D 0.023"], "D 0.020", Numbers.SAME, chance) == ["D 0.023"]


def test_a_study_is_edited_as_by_hand() -> None:
    study = "[tank]\nsize = 1\n\n[forces]\n# interval = 2\nsize = 3\n"
    changed = edited(study, '[forces]\nsize = 4\ninterval = "16ms"\n')
    assert changed == '[tank]\nsize = 1\n\n[forces]\ninterval = "16ms"\nsize = 4\n'
    with pytest.raises(AssertionError, match=r"tank\.interval"):
        edited(study, "[tank]\ninterval = 1\n")
