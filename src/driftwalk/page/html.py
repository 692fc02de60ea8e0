"""The HTML of pages: a report in one file that loads nothing, and what a server sends first."""

from __future__ import annotations

import base64
import hashlib
import html
import json
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any, Final, Literal
from urllib.parse import quote

from driftwalk.core.errors import InputError
from driftwalk.core.files.atomic import require_target, write_atomic

FORMAT: Final = "driftwalk page"
VERSION: Final = 1
"""Version of the data in a page; the script of a page reads its own alone."""
BUNDLE: Final[dict[str, str]] = {
    "driftwalk.css": "text/css; charset=utf-8",
    "driftwalk.js": "text/javascript; charset=utf-8",
}
"""The files of the front end and their types."""
WORKER: Final = "playground.js"
"""The program that runs a tank in the browser, next to the page."""
CORE: Final = "playground.wasm"
"""The native core for that, as WebAssembly."""
# What could end the element that holds the data, or break it as a program.
_ESCAPES: Final = {ord(sign): f"\\u{ord(sign):04x}" for sign in "<>&\u2028\u2029"}

_REPORT: Final = """\
<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="referrer" content="no-referrer">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
<div id="app"></div>
<noscript><p>This page needs JavaScript, which is switched off here. It loads nothing from \
anywhere.</p></noscript>
<script type="application/json" id="driftwalk-page">{page}</script>
{more}<script>{program}</script>
</body>
</html>
"""
_CORE: Final = """\
<script type="application/json" id="driftwalk-core">{core}</script>
<script type="text/plain" id="driftwalk-worker">{worker}</script>
"""
_SHELL: Final = """\
<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>driftwalk</title>
<link rel="icon" href="data:,">
<link rel="stylesheet" href="driftwalk.css{query}">
</head>
<body>
<div id="app"></div>
<script type="application/json" id="driftwalk-page">{page}</script>
<script src="driftwalk.js{query}"></script>
</body>
</html>
"""


def page_frame(view: str, title: str, **more: Any) -> dict[str, Any]:
    """Return a page without sections.

    Parameters
    ----------
    view : {"report", "run", "live", "play"}
        Which page it is.
    title : str
        Its title.
    **more
        Over the other keys.
    """
    from driftwalk import __version__

    return {
        "format": FORMAT,
        "version": VERSION,
        "view": view,
        "title": title,
        "subtitle": None,
        "state": {"finished": False, "progress": None, "words": None},
        "driftwalk_version": __version__,
        "created_utc": None,
        "sections": [],
        **more,
    }


def report_html(
    page: Mapping[str, Any],
    *,
    connect: Literal["none", "self"] = "none",
    core: Mapping[str, Any] | None = None,
) -> str:
    """Return a page as one HTML document that loads nothing from anywhere.

    Parameters
    ----------
    page : mapping
        Result of `report_page`.
    connect : {"none", "self"}
        Whether the document may talk to the server that it came from.
    core : mapping, optional
        What the native core needs to run in the document, see `save_playground`.

    Returns
    -------
    str
        The document, ASCII where the data stand. Its content security policy admits the style
        sheet and the program by their hashes, with a `core` its WebAssembly, and nothing else.

    Raises
    ------
    InputError
        When the installation lacks the program that shows a page, or the page holds a number that
        JSON lacks.

    Examples
    --------
    ``Path("report.html").write_text(report_html(report_page("run")), encoding="utf-8")``
    """
    style, program = (bundle_file(name) for name in BUNDLE)
    policy = "; ".join(
        [
            "default-src 'none'",
            f"script-src {_hash_source(program)}"
            + ("" if core is None else " 'wasm-unsafe-eval'; worker-src blob:"),
            f"style-src {_hash_source(style)}",
            "img-src data: blob:",
            *(["connect-src 'self'"] if connect == "self" else []),
            "base-uri 'none'",
            "form-action 'none'",
        ]
    )
    title = " · ".join(str(page[key]) for key in ("title", "subtitle") if page.get(key))
    return _REPORT.format(
        policy=policy,
        title=_text(title or "driftwalk"),
        style=style,
        page=embedded(page),
        more="" if core is None else _CORE.format(core=embedded(core), worker=bundle_file(WORKER)),
        program=program,
    )


def write_report(
    page: Mapping[str, Any],
    path: str | Path,
    *,
    existing: Literal["error", "replace"] = "error",
    core: Mapping[str, Any] | None = None,
) -> Path:
    """Write a page as one HTML file, whole or not at all.

    Parameters
    ----------
    page : mapping
        Result of `report_page`.
    path : path-like
        The file, which ends in ``.html`` or ``.htm``.
    existing : {"error", "replace"}
        Behaviour if the file exists already.
    core : mapping, optional
        As in `report_html`.

    Returns
    -------
    pathlib.Path
        The file. The same page gives the same bytes.

    Raises
    ------
    InputError
        When the file is there already, its folder is not, or its name ends otherwise.
    RunDirectoryError
        When it cannot be written.

    Examples
    --------
    ``write_report(report_page("run"), "report.html")``
    """
    target = Path(path)
    require_target(target, existing=existing, endings=(".html", ".htm"))
    write_atomic(target, report_html(page, core=core).encode("utf-8"))
    return target


def html_shell(page: Mapping[str, Any], *, token: str | None) -> str:
    """Return the HTML; what stands in the page is escaped, so that it can only be data.

    Parameters
    ----------
    page : dict
        As of `page_frame`.
    token : str or None
        Token that the browser must send with its requests.

    Examples
    --------
    >>> html = html_shell(page_frame("run", "</script><script>alert(1)"), token=None)
    >>> html.count("<script")
    2
    """
    query = "" if token is None else f"?token={quote(token)}"
    return _SHELL.format(page=embedded(page), query=query)


def embedded(page: Mapping[str, Any]) -> str:
    """Return page data as JSON that can stand inside a script element and is never run.

    Examples
    --------
    >>> "<" in embedded({"title": "</script>"})
    False
    """
    try:
        text = json.dumps(page, allow_nan=False, separators=(",", ":"))
    except ValueError as error:
        raise InputError(f"the page cannot be written as JSON: {error}") from error
    # `<`, `>` and `&` occur in JSON only inside strings, where an escape means the same.
    return text.translate(_ESCAPES)


def _text(value: str) -> str:
    """Return text for HTML; what no document may hold, such as half a surrogate, becomes "?"."""
    shown = "".join(c if c.isprintable() else "?" for c in value)
    return html.escape(shown.encode("utf-8", "replace").decode("utf-8"))


def bundle_bytes(name: str) -> bytes:
    """Return a file of the built front end as it is."""
    try:
        return (files("driftwalk.page") / "static" / name).read_bytes()
    except OSError as error:
        raise InputError(
            f"the installation lacks {name}, which shows the page: install driftwalk again, or in "
            "a clone of it run 'make web'"
        ) from error


def bundle_file(name: str) -> str:
    """Return a file of the built front end, with the line ends that a browser will see."""
    text = bundle_bytes(name).decode("utf-8")
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    closing = "</style" if name.endswith(".css") else "</script"
    if closing in text.lower() or "<!--" in text:
        raise InputError(f"{name} holds '{closing}' or '<!--', which would end it inside a page")
    return text


def _hash_source(text: str) -> str:
    digest = hashlib.sha256(text.encode("utf-8")).digest()
    return f"'sha256-{base64.b64encode(digest).decode('ascii')}'"
