"""Tables as CSV: a folder with one file per key."""

from __future__ import annotations

import csv
from contextlib import ExitStack
from math import isnan
from pathlib import Path
from typing import Any

from quadriga.export.columns import TickReached, build_columns, list_rows, table_file
from quadriga.export.source import Source


def write_csv(source: Source, out: Path, on_tick: TickReached) -> tuple[Path, ...]:
    """Write one file per key into the new folder `out`, numbers in full precision.

    Entries that a message does not have are empty, lists are numbers separated by spaces.
    """
    out.mkdir(parents=True)
    writers: dict[str, Any] = {}
    with ExitStack() as files:
        for item in source.items():
            writer = writers.get(item.name)
            if writer is None:
                path = table_file(out, item.name, "csv")
                file = files.enter_context(path.open("x", newline="", encoding="utf-8"))
                writer = writers[item.name] = csv.writer(file)
                writer.writerow(build_columns(item.layout, item.robot).names)
            for head, numbers, lists in list_rows(item):
                shown = ["" if isnan(value) else value for value in numbers]
                writer.writerow([*head, *shown, *(" ".join(map(repr, one)) for one in lists)])
            on_tick(item.message.tick)
    return tuple(table_file(out, name, "csv") for name in writers)
