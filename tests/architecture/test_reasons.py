"""Every number at module level has its reason, and every long function says why it does so."""

from __future__ import annotations

from textwrap import dedent

from reasons import constants_of, numeric_constants, silent_functions, silent_in

LONG = 40
"""Lines of code from which on a function needs a comment: more than a reader sees at once."""


def test_every_number_of_a_module_has_a_reason() -> None:
    bare = [f"{one.path}:{one.line} {one.name}" for one in numeric_constants() if not one.reason]
    assert not bare, "say below it, above it or beside it how the number was chosen"


def test_every_long_function_has_a_comment() -> None:
    bare = [f"{one.path}:{one.line} {one.name}" for one in silent_functions(LONG)]
    assert not bare, "say inside it why it is done in this order, or by this step"


def test_a_reason_stands_below_above_or_beside() -> None:
    source = dedent('''
        A = 1
        B: Final = (2, 3)
        """Below."""
        # Above,
        # in two lines.
        C = f(4)
        D = 5  # beside
        E = -6  # noqa: X1
        F = "text"
        G = Annotated[int, 7]
    ''')
    found = {one.name: one.reason for one in constants_of(source, "it.py")}
    assert found == {"A": "", "B": "Below.", "C": "Above, in two lines.", "D": "beside", "E": ""}


def test_a_long_function_without_a_comment_is_found() -> None:
    source = dedent('''
        def silent(x):
            """Say it
            in two lines."""
            y = x

            return y  # noqa

        def speaking(x):
            # Why.
            y = x
            return y
    ''')
    assert [(one.name, one.code) for one in silent_in(source, "it.py", 2)] == [("silent", 3)]
    assert not list(silent_in(source, "it.py", 3))
