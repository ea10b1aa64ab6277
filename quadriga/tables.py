"""Tables of text: on the terminal, as Markdown, and as aligned lines for a pipe."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from rich.console import Console, RenderableType
from rich.table import Table as RichTable
from rich.text import Text

from quadriga.shared.printable import printable, printable_line
from quadriga.shared.robots.conventions import OUTPUTS
from quadriga.table_layout import TablePart, is_prose, lay_out, least_widths, total

NOTHING: Final = "–"
_DEGREE: Final = "17.5 mrad are 1°."
_WIDE: Final = 180  # characters a line may have where no terminal says how many there are
# Unit of each output, and of each of `quadriga.recordings.traces.ERRORS`, and its factor from SI.
UNITS: Final = {
    "z": ("mm", 1e3), "z-over-stance-feet": ("mm", 1e3), "vx": ("mm/s", 1e3),
    "vy": ("mm/s", 1e3), "roll": ("mrad", 1e3), "pitch": ("mrad", 1e3), "wz": ("mrad/s", 1e3),
}  # fmt: skip


def error_text(name: str) -> str:
    """An output or an error as a reader knows it."""
    return name.replace("-over-stance-feet", " over the stance feet")


def label_output(name: str) -> str:
    """An output or an error with its unit, as a heading."""
    return f"{error_text(name)} [{UNITS[name][0]}]"


LABELS: Final = tuple(label_output(name) for name in OUTPUTS)


@dataclass(frozen=True, slots=True)
class Table:
    """A titled table; every row has a cell for every column, the first is the row's name.

    Attributes:
        title: one line, plain text.
        columns: their headings.
        rows: cells, plain text.
        notes: lines shown below the table.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: Sequence[str] = ()

    def to_rich(self, width: int) -> list[RenderableType]:
        """For a terminal of so many characters: what to print, one below the other.

        No number is cut: what does not fit is turned, or shown some columns at a time.
        """
        rows = [tuple(printable(cell) for cell in row) for row in self.rows]
        layout = lay_out(self.columns, rows, width)
        first, *others = layout.parts
        notes = [*([layout.note] if layout.note else []), *self._all_notes]
        return [
            _build_rich(first, self.title),
            *(_build_rich(part, "") for part in others),
            *(Text(note, style="dim") for note in notes),
        ]

    @property
    def _all_notes(self) -> tuple[str, ...]:
        """The notes, and of a table with angles what a degree is in their unit."""
        named = (*self.columns, *(row[0] for row in self.rows))
        angles = any("mrad" in text for text in named)
        return (*self.notes, *((_DEGREE,) if angles else ()))

    @property
    def least_width(self) -> int:
        """Characters of a line at which all columns stand side by side and nothing is cut."""
        return total(least_widths(self.columns, self.rows))

    def to_markdown(self, level: int = 2) -> str:
        """With a heading of this level."""
        rule = [":--", *("--:" for _ in self.columns[1:])]
        lines = [_row(self.columns), f"| {' | '.join(rule)} |", *map(_row, self.rows)]
        notes = [f"\n{note}" for note in self._all_notes]
        return "\n".join([f"{'#' * level} {self.title}\n", *lines, *notes]) + "\n"


def print_tables(tables: Iterable[Table]) -> None:
    """Print tables to stdout, as wide as the terminal or, without one, as they need."""
    console = Console()
    for table in tables:
        width = console.width if console.is_terminal else max(_WIDE, table.least_width)
        for part in table.to_rich(width):
            # Two columns may need more than the terminal has: it wraps them, and cuts nothing.
            Console(width=max(width, _width_of(part))).print(part)


def format_number(value: float | None, digits: str = ".3g", factor: float = 1.0) -> str:
    """A number, or a dash if there is none."""
    return NOTHING if value is None else format(value * factor, digits)


def format_output(name: str, value: float | None) -> str:
    """A figure of an output or an error in the unit of its label."""
    return format_number(value, ".1f", UNITS[name][1])


def align_columns(
    rows: Iterable[Sequence[str]], *, right: Collection[int] = (), indent: str = "  "
) -> list[str]:
    """Rows of cells as lines without borders, fit for a terminal, a pipe and `grep`.

    Args:
        rows: cells of text; the same number in each.
        right: columns that are flush right, as numbers are.
        indent: what each line begins with.
    """
    cells = [tuple(printable_line(cell) for cell in row) for row in rows]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    lines = []
    for row in cells:
        padded = [
            cell.rjust(width) if k in right else cell.ljust(width)
            for k, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append((indent + "  ".join(padded)).rstrip())
    return lines


def _width_of(part: RenderableType) -> int:
    """Characters of a line of a table whose columns have widths; 0: no table."""
    if not isinstance(part, RichTable):
        return 0
    return total([column.width or 0 for column in part.columns])


def _build_rich(part: TablePart, title: str) -> RichTable:
    table = RichTable(title=Text(title, style="table.title") if title else None)
    table.title_justify = "left"
    for k, (column, width) in enumerate(zip(part.columns, part.widths, strict=True)):
        is_text = not k or any(is_prose(row[k]) for row in part.rows)
        table.add_column(Text(column), justify="left" if is_text else "right", width=width)
    for row in part.rows:
        table.add_row(*map(Text, row))
    return table


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"
