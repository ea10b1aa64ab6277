"""Rows of cells as aligned lines without borders, fit for a terminal, a pipe and `grep`."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import Final
from unicodedata import category

NOTHING: Final = "–"


def columns(
    rows: Iterable[Sequence[str]], *, right: Collection[int] = (), indent: str = "  "
) -> list[str]:
    """One line for each row, its cells side by side.

    Args:
        rows: cells of text; the same number in each.
        right: columns that are flush right, as numbers are.
        indent: what each line begins with.
    """
    cells = [tuple(printable(cell).replace("\n", " ") for cell in row) for row in rows]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    lines = []
    for row in cells:
        padded = [
            cell.rjust(width) if k in right else cell.ljust(width)
            for k, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append((indent + "  ".join(padded)).rstrip())
    return lines


def printable(text: str) -> str:
    """Text that comes from elsewhere, without what a terminal would obey."""
    return "".join(
        "\N{REPLACEMENT CHARACTER}" if category(c) == "Cc" and c != "\n" else c for c in text
    )
