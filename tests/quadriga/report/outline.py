"""What a page consists of, as a browser would read it."""

from __future__ import annotations

import re
from html.parser import HTMLParser

_EMPTY = {"meta", "br", "img"}  # closed at once
_PATH = re.compile(r"[MlLQCz0-9 \n.-]*")


class Outline(HTMLParser):
    """Sections, texts, links and drawings of a page; an error if it is not well formed."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.sections: list[str] = []
        self.links: list[str] = []
        self.anchors: set[str] = set()
        self.figures: list[str] = []
        self.pictures: list[str] = []
        self.drawn: list[str] = []
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

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = {name: value or "" for name, value in attrs}
        assert values.get("src", "data:").startswith("data:"), "nothing is loaded"
        assert tag != "link", "nothing is loaded"
        assert values.get("xlink:href", "#").startswith("#"), "nothing is loaded"
        if tag == "section":
            self.sections.append(values["id"])
        self.anchors |= {values["id"]} if "id" in values else set()
        if tag == "a":
            self.links.append(values["href"])
        if tag == "svg":
            self.figures.append(values["aria-label"])
        if tag == "img":
            self.pictures.append(values["src"])
        if tag == "path":
            self.paths += 1
            assert _PATH.fullmatch(values["d"]), values["d"][:80]

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_startendtag(tag, attrs)
        if tag not in _EMPTY:
            self._open.append((tag, dict(attrs).get("class") or ""))

    def handle_endtag(self, tag: str) -> None:
        assert self._open, f"</{tag}> was never opened"
        assert self._open.pop()[0] == tag

    def handle_data(self, data: str) -> None:
        tag, style = self._open[-1] if self._open else ("", "")
        if tag not in ("style", "script") and data.strip():
            self._texts.append(data.strip())
        if tag == "text":
            self.drawn.append(data)
        if (tag, style) == ("td", "bad"):
            self.marked.append(data)
