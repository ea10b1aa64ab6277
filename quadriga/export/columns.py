"""The columns and rows of a key's table: one named column for each number."""

from __future__ import annotations

import re
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from quadriga.export.layout import MessageLayout
from quadriga.export.source import ExportedMessage

TIMES: Final = ("tick", "stamp_ns", "log_time_ns")
SAMPLE: Final = "sample"
_LONGEST: Final = 200  # bytes of a file's name, of which systems permit 255

TickReached = Callable[[int], None]  # called with the tick that an export has reached


@dataclass(frozen=True, slots=True)
class Columns:
    """Names of a table's columns, in three groups.

    Attributes:
        head: integers, texts and numbers that one message has once, with their types.
        numbers: float64, in the order of `MessageLayout.numbers`.
        lists: lists of float64.
    """

    head: tuple[tuple[str, type], ...]
    numbers: tuple[str, ...]
    lists: tuple[str, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """All names in order."""
        return (*(name for name, _ in self.head), *self.numbers, *self.lists)


def build_columns(layout: MessageLayout, robot: str) -> Columns:
    """Columns of the table of a key.

    Every name begins with the robot it is about, so that tables can be joined on `tick` without a
    clash: r1.q_joint.FL_hip. A plan has one row per sample of its horizon, counted by `sample`.
    """
    prefix = f"{robot}." if robot else ""
    head = [(name, int) for name in TIMES]
    head += [(SAMPLE, int)] if layout.by_sample else []
    return Columns(
        head=(*head, *((prefix + name, of) for name, of in layout.plain)),
        numbers=tuple(prefix + name for name in layout.numbers),
        lists=tuple(prefix + name for name in layout.lists),
    )


def list_rows(item: ExportedMessage) -> Iterator[tuple[list[Any], list[float], list[list[float]]]]:
    """Rows of one message: values of `head`, `numbers` and `lists`."""
    message, layout = item.message, item.layout
    times = [message.tick, message.stamp_ns, item.log_time_ns]
    plain = [getattr(message, name) for name, _ in layout.plain]
    lists = [getattr(message, name).tolist() for name in layout.lists]
    for sample, numbers in enumerate(item.numbers.tolist()):
        yield [*times, *([sample] if layout.by_sample else []), *plain], numbers, lists


def table_file(out: Path, name: str, suffix: str) -> Path:
    """The file of a key without its team: `r1/state` is r1.state.csv.

    A key that no file can be called by is cut, and told from others by its checksum.
    """
    stem = re.sub(r"[\0/]", ".", name)
    if "\0" in name or len(stem.encode()) > _LONGEST:
        cut = stem.encode()[:_LONGEST].decode("utf-8", "ignore")
        stem = f"{cut}-{zlib.crc32(name.encode()):08x}"
    return out / f"{stem}.{suffix}"
