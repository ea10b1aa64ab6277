"""Tables of text: on the terminal, as Markdown, and as aligned lines for a pipe."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from rich.console import Console
from rich.markup import escape
from rich.table import Table as RichTable

from quadriga.shared.printable import printable, printable_line
from quadriga.shared.robot.conventions import OUTPUTS

NOTHING: Final = "–"
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

    def to_rich(self) -> RichTable:
        """For a terminal, without the notes."""
        table = RichTable(title=escape(self.title), title_justify="left")
        for k, column in enumerate(self.columns):
            table.add_column(escape(column), justify="right" if k else "left", no_wrap=not k)
        for row in self.rows:
            table.add_row(*(escape(printable(cell)) for cell in row))
        return table

    def to_markdown(self, level: int = 2) -> str:
        """With a heading of this level."""
        rule = [":--", *("--:" for _ in self.columns[1:])]
        lines = [_row(self.columns), f"| {' | '.join(rule)} |", *map(_row, self.rows)]
        notes = [f"\n{note}" for note in self.notes]
        return "\n".join([f"{'#' * level} {self.title}\n", *lines, *notes]) + "\n"


def print_tables(tables: Iterable[Table]) -> None:
    """Print tables to stdout, as wide as the terminal or, without one, as they need."""
    console = Console()
    if not console.is_terminal:
        console = Console(width=_WIDE)
    for table in tables:
        console.print(table.to_rich())
        for note in table.notes:
            console.print(note, style="dim", markup=False, highlight=False)


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


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"
