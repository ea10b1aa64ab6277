"""How Sphinx makes the manual: `make docs`. Nothing on its pages is loaded from elsewhere."""

from __future__ import annotations

import re
from importlib.metadata import version as version_of
from typing import Any

project = "quadriga"
author = copyright = "The quadriga developers"
version = release = version_of("quadriga")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.mathjax",
    "sphinx-mathjax-offline",  # MathJax beside the pages, not from a server
]
exclude_patterns = ["_build", "results/**"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
autodoc_member_order = "bysource"
python_use_unqualified_type_names = True
nitpicky = False
highlight_language = "text"

linkcheck_ignore = [r"https?://(127\.|localhost)"]  # what a process of a team serves

html_theme = "furo"
html_title = f"quadriga {version}"
html_static_path = ["_static"]
html_css_files = ["manual.css"]
html_copy_source = html_show_sphinx = False

# What a generated page has for GitHub, so that others link to `page.md#name`.
_ANCHOR = re.compile(r'^<a id="([\w-]+)"></a>$', re.MULTILINE)
_anchors: dict[str, list[str]] = {}  # names by page


def turn_anchors_into_targets(_app: Any, page: str, source: list[str]) -> None:
    """Make of each anchor a target as MyST writes it, which links within the page find."""
    _anchors[page] = _ANCHOR.findall(source[0])
    source[0] = _ANCHOR.sub(r"(\1)=", source[0])


def show_targets_to_other_pages(app: Any, _doctree: Any) -> None:
    """Enter them where MyST looks for what a link from another page names: among the headings."""
    page = app.env.docname
    slugs = app.env.metadata[page].setdefault("myst_slugs", {})
    for name in _anchors.get(page, ()):
        slugs[name] = (0, name, name)


def setup(app: Any) -> None:
    """Called by Sphinx."""
    app.connect("source-read", turn_anchors_into_targets)
    app.connect("doctree-read", show_targets_to_other_pages)
