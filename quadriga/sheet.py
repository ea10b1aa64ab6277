"""A table of text that is shown on the terminal and written as Markdown alike."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from quadriga.columns import printable
from quadriga.shared.robot.a1 import OUTPUTS

NOTHING: Final = "–"
_WIDE: Final = 180  # characters a line may have where no terminal says how many there are
# Unit of each output, and of each of `quadriga.recordings.traces.ERRORS`, and its factor from SI.
UNITS: Final = {
    "z": ("mm", 1e3), "z-felt": ("mm", 1e3), "vx": ("mm/s", 1e3), "vy": ("mm/s", 1e3),
    "roll": ("mrad", 1e3), "pitch": ("mrad", 1e3), "wz": ("mrad/s", 1e3),
}  # fmt: skip


def label(name: str) -> str:
    """An output or an error with its unit, as a heading."""
    return f"{name} [{UNITS[name][0]}]"


LABELS: Final = tuple(label(name) for name in OUTPUTS)


@dataclass(frozen=True, slots=True)
class Sheet:
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

    def to_rich(self) -> Table:
        """For a terminal, without the notes."""
        table = Table(title=escape(self.title), title_justify="left")
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


def show(sheets: Iterable[Sheet]) -> None:
    """Print tables to stdout, as wide as the terminal or, without one, as they need."""
    console = Console()
    if not console.is_terminal:
        console = Console(width=_WIDE)
    for sheet in sheets:
        console.print(sheet.to_rich())
        for note in sheet.notes:
            console.print(note, style="dim", markup=False, highlight=False)


def text(value: float | None, digits: str = ".3g", factor: float = 1.0) -> str:
    """A number, or a dash if there is none."""
    return NOTHING if value is None else format(value * factor, digits)


def output_text(name: str, value: float | None) -> str:
    """A figure of an output or an error in the unit of its label."""
    return text(value, ".1f", UNITS[name][1])


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"
