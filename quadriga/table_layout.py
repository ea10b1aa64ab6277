"""How a table fits into so many characters without cutting a number: turned, or in parts. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from rich.cells import cell_len

_PROSE: Final = 24  # characters; a longer text with spaces in it may be broken at them
_BETWEEN: Final = 3  # characters that a column takes beside its text: a border and two spaces

Row = tuple[str, ...]


@dataclass(frozen=True, slots=True)
class TablePart:
    """A table, or a part of one, that fits.

    Attributes:
        columns: headings.
        rows: a cell for each column.
        widths: of the columns, characters; no cell needs more but for prose, which is broken.
    """

    columns: Row
    rows: tuple[Row, ...]
    widths: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class TableLayout:
    """How a table is shown.

    Attributes:
        parts: one below the other.
        note: what is to be said of it; "" where it is as it was written.
    """

    parts: tuple[TablePart, ...]
    note: str = ""


def lay_out(columns: Row, rows: Sequence[Row], width: int) -> TableLayout:
    """Show a table as it is, else turned by a quarter, else some columns at a time.

    All of it is shown, whatever the width. A single column that is wider than that stays so.

    Args:
        columns: headings; the first column names the rows and stands in each part.
        rows: a cell for each column.
        width: characters that a line may have.
    """
    whole = _fit(columns, rows, width)
    if whole is not None or len(columns) < 3:
        part = whole or TablePart(columns, (*rows,), least_widths(columns, rows))
        return TableLayout((part,))
    need = total(least_widths(columns, rows))
    turned = _turn(columns, rows)
    fitting = _fit(*turned, width)
    if fitting is not None:
        return TableLayout((fitting,), f"turned to fit into {width} characters: it has {need}")
    parts = tuple(_split(columns, rows, width))
    text = f"in {len(parts)} parts to fit into {width} characters: side by side they have {need}"
    return TableLayout(parts, f"{text}, and stand so in a pipe (| cat)")


def is_prose(cell: str) -> bool:
    """Whether a cell may be broken, at its spaces."""
    return " " in cell and _longest_line(cell) > _PROSE


def total(widths: Sequence[int]) -> int:
    """Characters of a line of columns so wide, with their borders."""
    return sum(widths) + _BETWEEN * len(widths) + 1


def least_widths(columns: Row, rows: Sequence[Row]) -> tuple[int, ...]:
    """The least widths at which no number and no word is cut."""
    return tuple(
        max(_longest_word(columns[k]), *(_unbroken(row[k]) for row in rows), 1)
        for k in range(len(columns))
    )


def _turn(columns: Row, rows: Sequence[Row]) -> tuple[Row, tuple[Row, ...]]:
    """Rows as columns."""
    first, *rest = zip(columns, *rows, strict=True)
    return first, tuple(rest)


def _fit(columns: Row, rows: Sequence[Row], width: int) -> TablePart | None:
    """The table in columns that fit; None if something would have to be cut."""
    least, most = least_widths(columns, rows), _most(columns, rows)
    if total(least) > width:
        return None
    widths, left = list(least), width - total(least)
    # Who needs least more gets it first: then the longest prose alone is broken.
    for k in sorted(range(len(columns)), key=lambda k: most[k] - least[k]):
        more = min(most[k] - least[k], left)
        widths[k] += more
        left -= more
    return TablePart(columns, (*rows,), tuple(widths))


def _split(columns: Row, rows: Sequence[Row], width: int) -> list[TablePart]:
    """As many columns at a time as fit beside the first."""
    parts, chosen = list[TablePart](), [0]
    for k in range(1, len(columns)):
        if len(chosen) > 1 and total(least_widths(*_pick(columns, rows, [*chosen, k]))) > width:
            parts.append(_part(columns, rows, chosen, width))
            chosen = [0]
        chosen.append(k)
    return [*parts, _part(columns, rows, chosen, width)]


def _part(columns: Row, rows: Sequence[Row], chosen: Sequence[int], width: int) -> TablePart:
    picked = _pick(columns, rows, chosen)
    return _fit(*picked, width) or TablePart(*picked, least_widths(*picked))


def _pick(columns: Row, rows: Sequence[Row], chosen: Sequence[int]) -> tuple[Row, tuple[Row, ...]]:
    return tuple(columns[k] for k in chosen), tuple(tuple(row[k] for k in chosen) for row in rows)


def _most(columns: Row, rows: Sequence[Row]) -> tuple[int, ...]:
    """The widths at which nothing is broken."""
    return tuple(
        max(_longest_line(columns[k]), *(_longest_line(row[k]) for row in rows), 1)
        for k in range(len(columns))
    )


def _unbroken(cell: str) -> int:
    """Characters of a cell that must stay in one line."""
    return _longest_word(cell) if is_prose(cell) else _longest_line(cell)


def _longest_line(text: str) -> int:
    return max(map(cell_len, text.split("\n")))


def _longest_word(text: str) -> int:
    return max(map(cell_len, text.split()), default=0)
