"""The HTML file: nothing from outside, nothing of the data ever becomes a program."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, strategies as st
from page_reading import Document, page_in

from driftwalk.core.errors import InputError
from driftwalk.page import report_html, write_report
from driftwalk.page.html import embedded

HOSTILE = [
    "<script>alert(1)</script>",
    "</script><img src=x onerror=alert(1)>",
    "<!--<script>",
    "]]>",
    "\"'><svg/onload=alert(1)>",
    "../../etc/passwd",
    "\u2028\u2029\x00\x1b",
    "&lt;b&gt;",
    "\udce9 half a surrogate",
    "${alert(1)} `",
]
TEXT = st.text(st.characters()) | st.sampled_from(HOSTILE)
JSON = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**53), 2**53) | st.floats(-1e300, 1e300) | TEXT,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(TEXT, inner, max_size=4),
    max_leaves=12,
)


def page(**content: Any) -> dict[str, Any]:
    return {"title": "Run", "subtitle": None, "sections": [], **content}


@pytest.mark.slow
@given(st.dictionaries(TEXT, JSON, max_size=4))
def test_any_data_come_back_from_the_document(data: dict[str, Any]) -> None:
    text = report_html(page(data=data))
    assert page_in(text)["data"] == data


@pytest.mark.parametrize("text", HOSTILE)
def test_hostile_text_adds_no_element(text: str) -> None:
    plain = Document(report_html(page(title="a", subtitle="b")))
    hostile = page(
        title=text,
        subtitle=text,
        sections=[{"id": text, "kind": text, "title": text, "items": [text, {text: text}]}],
    )
    html = report_html(hostile)
    found = Document(html)
    assert found.tags() == plain.tags()
    assert page_in(html) == hostile
    assert not [key for _, attrs in found.elements for key in attrs if key.startswith("on")]
    html.encode("utf-8")


def test_the_title_is_readable_text() -> None:
    text = report_html(page(title="Run", subtitle="<b> & \x00\udce9"))
    assert Document(text).text_of("title") == ["Run · <b> & ??"]
    assert "<title>Run · &lt;b&gt; &amp; ??</title>" in text


def policy_of(document: Document) -> dict[str, str]:
    content = next(
        attrs["content"]
        for tag, attrs in document.elements
        if tag == "meta" and attrs.get("http-equiv") == "Content-Security-Policy"
    )
    assert content is not None
    return dict(part.strip().split(" ", 1) for part in content.split(";"))


def test_the_policy_admits_what_is_inside_and_nothing_else() -> None:
    text = report_html(page())
    policy = policy_of(Document(text))
    assert policy["default-src"] == "'none'"
    assert "connect-src" not in policy
    assert "unsafe" not in str(policy)
    for element, directive in (("script", "script-src"), ("style", "style-src")):
        inside = re.findall(rf"<{element}>(.*?)</{element}>", text, re.DOTALL)
        assert len(inside) == 1
        digest = hashlib.sha256(inside[0].encode("utf-8")).digest()
        assert policy[directive] == f"'sha256-{base64.b64encode(digest).decode()}'"


def test_a_page_of_a_server_may_talk_to_it_alone() -> None:
    policy = policy_of(Document(report_html(page(), connect="self")))
    assert policy["connect-src"] == "'self'"


def test_nothing_is_loaded_from_anywhere() -> None:
    document = Document(report_html(page()))
    assert not {"link", "img", "iframe", "object", "embed", "base"} & set(document.tags())
    assert not [attrs for _, attrs in document.elements if {"src", "href"} & attrs.keys()]


def test_the_data_are_ascii_and_hold_no_angle_bracket() -> None:
    text = embedded({"a": "".join(HOSTILE)})
    assert text.isascii()
    assert not set("<>&") & set(text)
    assert json.loads(text) == {"a": "".join(HOSTILE)}


def test_what_json_lacks_is_refused() -> None:
    with pytest.raises(InputError, match="cannot be written as JSON"):
        embedded({"a": float("nan")})


def test_a_missing_front_end_is_said(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("driftwalk.page.html.files", lambda package: tmp_path)
    with pytest.raises(InputError, match=r"lacks driftwalk\.css.*install driftwalk again"):
        report_html(page())


@pytest.mark.parametrize("content", ["a</script>b", "a</SCRIPT >b", "<!--"])
def test_a_front_end_that_would_end_its_element_is_refused(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, content: str
) -> None:
    (tmp_path / "static").mkdir()
    (tmp_path / "static" / "driftwalk.css").write_text("p {}", encoding="utf-8")
    (tmp_path / "static" / "driftwalk.js").write_text(content, encoding="utf-8")
    monkeypatch.setattr("driftwalk.page.html.files", lambda package: tmp_path)
    with pytest.raises(InputError, match="would end it inside a page"):
        report_html(page())


def test_a_file_is_written_whole_and_not_over_another(tmp_path: Path) -> None:
    target = tmp_path / "report.html"
    assert write_report(page(), target) == target
    before = target.read_bytes()
    with pytest.raises(InputError, match="exists already"):
        write_report(page(title="other"), target)
    assert target.read_bytes() == before
    write_report(page(), target, existing="replace")
    assert target.read_bytes() == before
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]


def test_another_ending_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"ends in \.html or \.htm"):
        write_report(page(), tmp_path / "report.pdf")
