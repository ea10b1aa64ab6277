"""What a page consists of, as a browser would read it."""

from __future__ import annotations

import re
from html.parser import HTMLParser

_EMPTY = {"meta", "path", "rect", "circle", "br"}  # closed at once
_PATH = re.compile(r"[MLHVmlhvz0-9 .-]*")


class Outline(HTMLParser):
    """Sections, texts, links and drawings of a page; an error if it is not well formed."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.sections: list[str] = []
        self.links: list[str] = []
        self.anchors: set[str] = set()
        self.figures: list[str] = []
        self.titles: list[str] = []
        self.marks: list[str] = []
        self.marked: list[str] = []
        self.paths = 0
        self._open: list[tuple[str, str]] = []
        self._texts: list[str] = []
        self.feed(page)
        self.close()
        assert not self._open, f"not closed: {self._open}"

    @property
    def text(self) -> str:
        """All that can be read."""
        return " ".join(self._texts)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = {name: value or "" for name, value in attrs}
        assert "src" not in values, "nothing is loaded"
        assert tag != "link", "nothing is loaded"
        if tag == "section":
            self.sections.append(values["id"])
        self.anchors |= {values["id"]} if "id" in values else set()
        if tag == "a":
            self.links.append(values["href"])
        if tag == "svg" and "aria-label" in values:
            self.figures.append(values["aria-label"])
        if tag == "path":
            self.paths += 1
            assert _PATH.fullmatch(values["d"]), values["d"][:80]
        if tag not in _EMPTY:
            self._open.append((tag, values.get("class", "")))

    def handle_endtag(self, tag: str) -> None:
        if tag not in _EMPTY:
            assert self._open, f"</{tag}> was never opened"
            assert self._open.pop()[0] == tag

    def handle_data(self, data: str) -> None:
        tag, style = self._open[-1] if self._open else ("", "")
        if tag not in ("style", "script") and data.strip():
            self._texts.append(data.strip())
        if (tag, style) == ("text", "title"):
            self.titles.append(data)
        if tag == "text" and "fall" in style:
            self.marks.append(data)
        if (tag, style) == ("td", "bad"):
            self.marked.append(data)
