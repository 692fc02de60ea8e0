"""The HTML that every page begins with: the front end, and which page it is to show."""

from __future__ import annotations

from importlib.resources import files
from typing import Any, Final
from urllib.parse import quote

from driftwalk.core.errors import InputError
from driftwalk.viewer.messages import to_json

BUNDLE: Final[dict[str, str]] = {
    "driftwalk.js": "text/javascript; charset=utf-8",
    "driftwalk.css": "text/css; charset=utf-8",
}
"""The files of the front end and their types."""
# What could end a script element, or a line of JavaScript, is written as its code.
ESCAPED: Final = {ord(sign): f"\\u{ord(sign):04x}" for sign in "<>&\u2028\u2029"}

SHELL: Final = """\
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
    view : {"run", "live", "play"}
        Which page it is.
    title : str
        Its title.
    **more
        Over the other keys.
    """
    from driftwalk import __version__

    return {
        "format": "driftwalk page",
        "version": 1,
        "view": view,
        "title": title,
        "subtitle": None,
        "state": {"finished": False, "progress": None, "words": None},
        "driftwalk_version": __version__,
        "created_utc": None,
        "sections": [],
        **more,
    }


def html_shell(page: dict[str, Any], *, token: str | None) -> str:
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
    return SHELL.format(page=to_json(page).translate(ESCAPED), query=query)


def bundle_file(name: str) -> bytes:
    """Return a file of the front end.

    Raises
    ------
    InputError
        When the installation lacks it.
    """
    try:
        return (files("driftwalk.page") / "static" / name).read_bytes()
    except FileNotFoundError as error:
        raise InputError(
            f"this installation of driftwalk lacks the front end ({name}); install it again"
        ) from error
