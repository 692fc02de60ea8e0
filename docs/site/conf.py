"""Configuration of the site: every page of this folder's repository, and a gallery.

    make site    # builds it into build/site

The sources lie in the root of the repository, so that links between the pages and to files beside
`docs` mean the same here and where the code is read.
"""

from __future__ import annotations

import re
import sys
from importlib.metadata import version as version_of
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parents[1] / "tests" / "architecture")]

import command_pages  # noqa: E402
from api_pages import write_pages  # noqa: E402
from contents import add_contents  # noqa: E402

from driftwalk.cli.main import load_command  # noqa: E402

project = "driftwalk"
author = "The driftwalk developers"
copyright = author
release = version_of("driftwalk")

extensions = [
    "myst_parser",
    "sphinx_copybutton",
    "sphinx_gallery.gen_gallery",
    "sphinx.ext.mathjax",
    "sphinx-mathjax-offline",
]
root_doc = "docs/index"
include_patterns = [
    "*.md",
    "docs/*.md",
    "docs/**/*.md",
    "docs/gallery/**",
    "studies/*/README.md",
]
exclude_patterns = [
    *("docs/gallery/**/*.ipynb", "docs/gallery/**/*.py", "docs/gallery/**/*.zip"),
    # A page for each command has its place.
    "docs/reference/command-line.md",
]

myst_heading_anchors = 4
myst_enable_extensions = ["dollarmath"]

html_theme = "furo"
html_title = f"driftwalk {release}"
html_copy_source = False
html_show_sourcelink = False
html_show_copyright = False
html_favicon = str(HERE / "static" / "logo.svg")
html_static_path = [str(HERE / "static")]
html_css_files = ["pages.css"]
html_js_files = [("pages.js", {"defer": ""})]
templates_path = ["theme"]
html_additional_pages = {"index": "front.html"}
html_context = {
    "loop": (HERE / "theme" / "loop.svg").read_text(encoding="utf-8"),
    # `make site` saves it next to the front page, with a driftwalk that can.
    "playground": any("--save" in one.opts for one in load_command("play").params),
}

copybutton_prompt_text = "$ "
copybutton_only_copy_prompt_lines = False

sphinx_gallery_conf = {
    "examples_dirs": "docs/site/gallery",
    "gallery_dirs": "docs/gallery",
    "filename_pattern": r"\.py$",
    "within_subsection_order": "FileNameSortKey",
    "download_all_examples": False,
    # Twice the size of a card, so that the words of a whole figure stay sharp.
    "thumbnail_size": (640, 400),
    "show_memory": False,
    "show_signature": False,
    "remove_config_comments": True,
    "min_reported_time": 1e9,
    # Its page would load programs from elsewhere.
    "write_computation_times": False,
    "abort_on_example_error": True,
    "matplotlib_animations": False,
    # What an example prints, and no names of objects.
    "capture_repr": ("_repr_html_",),
    "image_scrapers": ("matplotlib",),
    # Twice as fine for screens that can.
    "image_srcset": ["2x"],
    "reset_modules": ("matplotlib", "print_look.reset"),
}


def refuse_requests(app: Any, error: Exception | None) -> None:
    """End a build in which a page loads anything from elsewhere: the site works offline."""
    from sphinx.errors import ExtensionError

    loads = re.compile(
        r'<(?:script|img|iframe|source|link)\b[^>]*\b(?:src|href)="(?:https?:)?//[^"]*'
    )
    for page in [] if error else Path(app.outdir).rglob("*.html"):
        if found := loads.search(page.read_text(encoding="utf-8")):
            raise ExtensionError(f"{page} loads from elsewhere: {found[0]}")


def search_without_previews(app: Any, name: str, *_: object) -> None:
    """Leave the text below a hit out where the site is a folder: browsers fetch no files."""
    if name == "search":
        off = "DOCUMENTATION_OPTIONS.SHOW_SEARCH_SUMMARY = false"
        app.add_js_file(None, body=f'if (location.protocol === "file:") {off};')


def setup(app: object) -> None:
    """Make the pages of the Python names, and the table of contents of the front page's links."""
    write_pages()
    command_pages.write_pages()
    app.connect("build-finished", refuse_requests)  # type: ignore[attr-defined]
    app.connect("source-read", command_pages.move_links)  # type: ignore[attr-defined]
    app.connect("source-read", add_contents)  # type: ignore[attr-defined]
    app.connect("html-page-context", search_without_previews)  # type: ignore[attr-defined]
