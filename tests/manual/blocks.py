"""The commands and programs that README and manual show: fenced blocks, and what is said of them.

A comment before a block may say `<!-- not run: why -->`; `<!-- short: OPTIONS -->`, which are added
to each of its commands when it is run; `<!-- short: live -->`, of commands to a team that walks; or
`<!-- excerpt: FILE -->`, of text that stands in a file of the project.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from quadriga.shared.runtime.places import SOURCE

DOCS: Final = SOURCE / "docs"
_READ_ELSEWHERE: Final = ("CONTRIBUTING.md", "deploy/README.md", "deploy/laptop/README.md")
OTHERS: Final = tuple(SOURCE / name for name in _READ_ELSEWHERE)  # pages beside the manual
NOT_RUN: Final = "not run"
SHORT: Final = "short"
EXCERPT: Final = "excerpt"
LIVE: Final = "live"
_OTHERS: Final = ("_build", "results")  # folders of docs without pages of the manual
# Pages whose blocks are typed one after the other by tests of their own.
RUN_ELSEWHERE: Final = frozenset(("docs/extending.md",))
_FENCE: Final = re.compile(r"^```(sh|python)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_ANY_FENCE: Final = re.compile(r"^```(\S*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_SPAN: Final = re.compile(r"`([^`]+)`")
_SAID: Final = re.compile(r"<!-- (not run|short|excerpt):\s*(.*?)\s*-->\n+\Z")

_SIGNS: Final = frozenset(";()<>|&")
_ASSIGNMENT: Final = re.compile(r"[A-Za-z_]\w*=")


@dataclass(frozen=True, slots=True)
class Block:
    """A fenced block of a page.

    Attributes:
        page: the file, from the top of the checkout.
        line: its first line in the page.
        language: `sh` or `python`.
        text: what stands in it.
        marker: `not run`, `short`, `excerpt`, or "".
        said: behind the marker's colon.
    """

    page: str
    line: int
    language: str
    text: str
    marker: str = ""
    said: str = ""

    @property
    def name(self) -> str:
        """Where it is."""
        return f"{self.page}:{self.line}"


def list_pages() -> list[Path]:
    """README and all pages of the manual."""
    pages = (path for path in DOCS.rglob("*.md") if path.relative_to(DOCS).parts[0] not in _OTHERS)
    return [SOURCE / "README.md", *sorted(pages)]


def find_blocks(text: str, page: str) -> list[Block]:
    """The blocks of a page's text."""
    found = []
    for match in _FENCE.finditer(text):
        before = text[: match.start()]
        said = _SAID.search(before)
        marker, words = (said[1], said[2]) if said else ("", "")
        line = before.count("\n") + 2
        found.append(Block(page, line, match[1], match[2], marker, words))
    return found


def find_spans(text: str) -> list[str]:
    """What a page's prose shows as code, each on one line."""
    return [" ".join(span.split()) for span in _SPAN.findall(_ANY_FENCE.sub("", text))]


def all_blocks() -> list[Block]:
    """The blocks of all pages, in their order."""
    found = []
    for path in list_pages():
        text = path.read_text(encoding="utf-8")
        found += find_blocks(text, path.relative_to(SOURCE).as_posix())
    return found


def split_commands(text: str) -> list[list[str]]:
    """The words of each command, without redirections and without variables set for it.

    What may fail, as `a` of `a || b` may, is left out.
    """
    lines = text.replace("\\\n", " ").splitlines()
    return [command for line in lines for command in _split_line(line)]


def _split_line(line: str) -> Iterator[list[str]]:
    lexer = shlex.shlex(line, posix=True, punctuation_chars=True)
    lexer.whitespace_split = True
    words: list[str] = []
    redirected = False
    for token in lexer:
        if redirected:  # the file that is read or written
            redirected = False
        elif not _SIGNS.issuperset(token):
            words.append(token)
        elif token in (">", ">>", "<", ">&"):
            redirected = True
            if words and words[-1].isdigit():
                words.pop()
        else:
            if token != "||":
                yield from _without_assignments(words)
            words = []
    yield from _without_assignments(words)


def _without_assignments(words: list[str]) -> Iterator[list[str]]:
    while words and _ASSIGNMENT.match(words[0]):
        words = words[1:]
    if words:
        yield words
