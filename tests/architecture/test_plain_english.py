"""Pages, help, messages and docstrings keep out of the words that read as if translated.

The list is one of habits: old or roundabout words, sentences that begin with a clause "What …",
and fragments "Of X: …". Questions and headings may begin with "What".
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final, NamedTuple

import pytest
from package_texts import package_texts

ROOT: Final = Path(__file__).resolve().parents[2]
PAGES: Final = sorted(
    page
    for page in (
        *ROOT.glob("*.md"),
        *(ROOT / "docs").rglob("*.md"),
        *(ROOT / "studies").glob("*/README.md"),
        *(ROOT / "benchmarks").rglob("*.md"),
    )
)
WORDS: Final = {
    "anew": "again",
    "stands for": "is, or means",
    "stand for": "is, or means",
    "beside": "next to",
    "told": "reported",
    "so long": "this long",
    "for ever": "permanently",
    "of the very": "of the … itself",
    "whoever": "anyone who",
    "nobody": "unknown, or not asked for",
    "in vain": "without a result",
    "as it were": "nothing",
    "otherwise than": "not as, or unlike",
    "feign": "imitate",
    "feigns": "imitates",
    "feigned": "imitated",
    "condemn": "reject",
    "condemns": "rejects",
    "condemned": "rejected",
    "hopeless": "given up",
    "befell": "happened to",
    "blame": "the cause, or at fault",
    "blamed": "named as the cause",
}
"""Words to avoid, each with the plain one."""
REFERENCES: Final = re.compile(r"\b(?:that|those)\s+of\b", re.IGNORECASE)
MOST_REFERENCES: Final = {"package": 278, "pages": 70}
"""How often "that of" and "those of" may stand in each. The limits only fall: a reader has to look
back for what is meant, so name it again, or use a genitive."""
ALLOWED: Final = {
    r'"beside"|\Abeside\Z': "a value of the plotting functions' argument colorbar",
    r"\bbeside(?= ?[=:])": "an argument of plot_outcomes and outcome_figure",
    r"\bBeside or None\b": "the name of a class",
}
"""Patterns that are not looked at, each with the reason."""
WORD: Final = re.compile(
    r"\b(?:" + "|".join(word.replace(" ", r"\s+") for word in WORDS) + r")\b", re.IGNORECASE
)
BEGIN: Final = (
    r"(?:\A|(?<=[.:;!?] )|(?<=[.:;!?]\n)|(?<=\n\n)|(?<=\| )|^(?=[-*|] |\d+\. ))"
    r"(?:[-*|] |\d+\. |\*\*)*"
)
CLAUSE: Final = re.compile(BEGIN + r"What\b[^.?]*(?:[.]|\Z)", re.MULTILINE)
FRAGMENT: Final = re.compile(BEGIN + r"Of [\w -]+: ", re.MULTILINE)
RULES: Final = {"": WORD, "What": CLAUSE, "Of ": FRAGMENT}
"""By a word without which a text keeps them; most texts are without."""


class Fault(NamedTuple):
    """A place that does not read plainly."""

    line: int
    words: str


def faults_of(text: str) -> list[Fault]:
    """Return the places of a text that break a rule, with the line counted from 1."""
    for pattern in ALLOWED if "eside" in text else ():
        text = re.sub(pattern, lambda match: " " * len(match[0]), text)
    return [
        Fault(text.count("\n", 0, match.start()) + 1, " ".join(match[0].split())[:60])
        for word, rule in RULES.items()
        if word in text
        for match in rule.finditer(text)
    ]


def prose_of(page: str) -> str:
    """Return a page without code, targets of links and headings, on the same lines."""
    gone = r"```.*?```|`[^`\n]*`|(?<=\])\([^)]*\)|^#[^\n]*$|<!--.*?-->"
    return re.sub(
        gone, lambda match: "\n" * match[0].count("\n"), page, flags=re.DOTALL | re.MULTILINE
    )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("The fit is made anew.", "anew"),
        ("Dropped frames are told.", "told"),
        ("It stands\nfor the block.", "stands for"),
        ("A recording of the very model.", "of the very"),
        ("Joined. What jumps faster is another one.", "What jumps faster is another one."),
        ("- What is missing is left out.", "- What is missing is left out."),
        ("| code | What it means. |", "What it means."),
        ("Of the blob: its size.", "Of the blob:"),
    ],
)
def test_a_fault_is_found(text: str, words: str) -> None:
    assert faults_of(text) == [Fault(1, words)]


@pytest.mark.parametrize(
    "text",
    [
        "What is in the file? Positions.",
        "It says what was found; so do the others.",
        "Both are drawn next to each other as long as there is room.",
        'colorbar : {"beside", "none"}',
        "Of the 16 recordings, two failed.",
    ],
)
def test_plain_words_pass(text: str) -> None:
    assert not faults_of(text)


def test_code_and_headings_are_not_looked_at() -> None:
    page = "## What it is\n\n```\ntold\n```\n[a](beside.md) `anew`\n\nTold.\n"
    assert faults_of(prose_of(page)) == [Fault(8, "Told")]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_page_is_plain(page: Path) -> None:
    assert not faults_of(prose_of(page.read_text(encoding="utf-8")))


def test_strings_and_docstrings_are_plain() -> None:
    found = [
        f"{one.path}:{one.line + fault.line - 1}: {fault.words}"
        for one in package_texts()
        for fault in faults_of(re.sub(r"\n +", "\n", one.text))
    ]
    assert not found, "\n".join(found)


def test_a_reader_seldom_has_to_look_back() -> None:
    texts = {
        "package": [one.text for one in package_texts()],
        "pages": [prose_of(page.read_text(encoding="utf-8")) for page in PAGES],
    }
    found = {
        where: sum(len(REFERENCES.findall(text)) for text in many) for where, many in texts.items()
    }
    over = {where: count for where, count in found.items() if count > MOST_REFERENCES[where]}
    assert not over, f"{over} of {MOST_REFERENCES}"
