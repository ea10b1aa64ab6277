"""Text that comes from elsewhere, fit for a terminal.

Events, reasons, keys and names are what whoever reaches the bus, or has written a file, wants them
to be: escape sequences that clear the screen, letters that run backwards, lines that look like
ours. What is shown to a person on a terminal or in a log goes through here.
"""

from __future__ import annotations

from typing import Final
from unicodedata import category

# Control characters, formats such as those that turn the direction, half characters, and what some
# programs take for the end of a line.
_OBEYED: Final = frozenset(("Cc", "Cf", "Cs", "Zl", "Zp"))


def printable(text: str) -> str:
    """The text without what a terminal would obey; its lines stay."""
    if text.isprintable():
        return text
    return "".join(_shown(c) for c in text)


def printable_line(text: str) -> str:
    """The text in one line, without what a terminal would obey."""
    return printable(text).replace("\n", " ")


def _shown(c: str) -> str:
    return c if c == "\n" or category(c) not in _OBEYED else "\N{REPLACEMENT CHARACTER}"
