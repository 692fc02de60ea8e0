"""Who may come in: a table of requests, each with what a server has to say to it."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from driftwalk.page.html import html_shell, page_frame
from driftwalk.viewer.security import Gate, host_name, is_loopback, make_gate
from driftwalk.viewer.watch.run_page import file_in

HERE = Gate("127.0.0.1", 8765)
THERE = Gate("0.0.0.0", 8765, token="secret")

# Host, Origin, and whether a server on loopback takes the request.
REQUESTS = [
    ("127.0.0.1:8765", None, True),
    ("localhost:8765", None, True),
    ("LOCALHOST:8765", None, True),
    ("[::1]:8765", None, True),
    ("127.0.0.1:8765", "http://127.0.0.1:8765", True),
    ("localhost:8765", "http://localhost:8765", True),
    # Through a tunnel the port is another one.
    ("localhost:9000", "http://localhost:9000", True),
    # A name that an attacker points at 127.0.0.1.
    ("evil.example:8765", None, False),
    ("evil.example:8765", "http://evil.example:8765", False),
    ("127.0.0.1.evil.example:8765", None, False),
    ("localhost.evil.example", None, False),
    ("192.168.1.5:8765", None, False),
    ("", None, False),
    ("localhost:8765, evil.example", None, False),
    # A page of another site that opens a WebSocket here.
    ("127.0.0.1:8765", "http://evil.example", False),
    ("127.0.0.1:8765", "https://127.0.0.1:8765", False),
    ("127.0.0.1:8765", "http://127.0.0.1:8000", False),
    ("127.0.0.1:8765", "http://localhost:8765", False),
    ("127.0.0.1:8765", "null", False),
    ("127.0.0.1:8765", "", False),
    ("127.0.0.1:8765", "http://127.0.0.1:8765.evil.example", False),
]


@pytest.mark.parametrize(("host", "origin", "taken"), REQUESTS)
def test_host_and_origin(host: str, origin: str | None, taken: bool) -> None:
    headers = {"host": host} | ({} if origin is None else {"origin": origin})
    assert (HERE.refusal(headers, {}) is None) == taken


def test_no_host_is_refused() -> None:
    assert HERE.refusal({}, {}) is not None


@pytest.mark.parametrize(
    ("token", "taken"), [("secret", True), ("", False), ("Secret", False), ("secretsecret", False)]
)
def test_token(token: str, taken: bool) -> None:
    headers = {"host": "192.168.1.5:8765"}
    assert (THERE.refusal(headers, {"token": token}) is None) == taken
    assert THERE.refusal(headers, {}) is not None


def test_a_name_of_an_attacker_is_refused_even_with_the_token() -> None:
    assert THERE.refusal({"host": "evil.example:8765"}, {"token": "secret"}) is not None


@pytest.mark.parametrize(
    ("host", "loopback"),
    [
        ("127.0.0.1", True),
        ("127.0.0.53", True),
        ("::1", True),
        ("localhost", True),
        ("0.0.0.0", False),
        ("::", False),
        ("192.168.1.5", False),
        ("lab", False),
    ],
)
def test_token_is_made_away_from_loopback(host: str, loopback: bool) -> None:
    assert is_loopback(host) == loopback
    gate = make_gate(host, 1)
    assert (gate.token is None) == loopback
    assert ("token=" in gate.address()) == (not loopback)


def test_tokens_are_long_and_differ() -> None:
    tokens = {make_gate("0.0.0.0", 1).token for _ in range(100)}
    assert len(tokens) == 100
    # 128 bits, six to a character.
    assert all(token is not None and len(token) >= 21 for token in tokens)


@given(st.text())
def test_no_text_as_host_or_origin_comes_in(text: str) -> None:
    if host_name(text.lower()) not in ("127.0.0.1", "localhost", "[::1]"):
        assert HERE.refusal({"host": text}, {}) is not None
    if text.lower() != "http://localhost:8765":
        assert HERE.refusal({"host": "localhost:8765", "origin": text}, {}) is not None


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a run directory with something beside it that must not be served."""
    run = tmp_path / "run"
    (run / "figures").mkdir(parents=True)
    (run / ".shards").mkdir()
    for name in ("a.nc", "figures/map.png", ".run.json", ".shards/x.npz", "<script>.txt", "a b&c"):
        (run / name).write_text("inside")
    (tmp_path / "secret").write_text("outside")
    (run / "link").symlink_to(tmp_path / "secret")
    (run / "up").symlink_to(tmp_path)
    (run / "own").symlink_to(run / "a.nc")
    (run / "hidden").symlink_to(run / ".run.json")
    return run


@pytest.mark.parametrize("name", ["a.nc", "figures/map.png", "<script>.txt", "a b&c", "own"])
def test_files_of_the_run_are_served(folder: Path, name: str) -> None:
    found = file_in(folder, name)
    assert found is not None
    assert found.read_text() == "inside"


@pytest.mark.parametrize(
    "name",
    [
        *("", ".", "..", "/", "//", "figures", "figures/", "nothing"),
        *("../secret", "figures/../../secret", "figures/../a.nc", "./a.nc", "/etc/passwd"),
        *("//etc/passwd", "..\\secret", "figures\\map.png", "link", "up/secret", "hidden"),
        *(".run.json", ".shards/x.npz", "a.nc/", "a.nc\0", "a\0.nc", "%2e%2e/secret", "x" * 5000),
    ],
)
def test_nothing_else_is_served(folder: Path, name: str) -> None:
    assert file_in(folder, name) is None


@given(st.text(alphabet="./\\abc\0~", max_size=12))
def test_no_path_leaves_the_run(name: str) -> None:
    root = Path(__file__).resolve().parent
    found = file_in(root, name)
    assert found is None or found.is_relative_to(root)


@pytest.mark.parametrize(
    "title",
    [
        "</script><script>alert(1)</script>",
        "<!--<script>",
        "]]>\u2028\u2029",
        "<img src=x onerror=alert(1)>",
        '"; alert(1); "',
    ],
)
def test_a_hostile_title_stays_data(title: str) -> None:
    import json
    import re

    html = html_shell(page_frame("run", title), token=None)
    data = re.findall(r'<script type="application/json" id="driftwalk-page">(.*?)</script>', html)
    assert len(data) == 1
    assert json.loads(data[0])["title"] == title
    assert not set(data[0]) & set("<>&\u2028\u2029")
    assert html.count("<script") == 2


def test_the_token_is_passed_on_to_the_front_end() -> None:
    html = html_shell(page_frame("run", "run"), token="a-b_c")
    assert 'src="driftwalk.js?token=a-b_c"' in html
