"""Tables as Parquet: a folder with one file per key."""

from __future__ import annotations

from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any, Final, Self

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from quadriga.export.columns import Columns, TickReached, build_columns, list_rows, table_file
from quadriga.export.source import ExportedMessage, Source

_BATCH: Final = 10_000  # rows that are kept in memory
_TYPES: Final = {bool: pa.bool_(), int: pa.int64(), float: pa.float64(), str: pa.string()}


def write_parquet(source: Source, out: Path, on_tick: TickReached) -> tuple[Path, ...]:
    """Write one file per key into the new folder `out`; missing numbers are null."""
    out.mkdir(parents=True)
    tables: dict[str, _ParquetFile] = {}
    with ExitStack() as files:
        for item in source.items():
            table = tables.get(item.name)
            if table is None:
                columns = build_columns(item.layout, item.robot)
                path = table_file(out, item.name, "parquet")
                table = tables[item.name] = files.enter_context(_ParquetFile(path, columns))
            table.append(item)
            on_tick(item.message.tick)
    return tuple(table_file(out, name, "parquet") for name in tables)


class _ParquetFile:
    """One file, written batch by batch."""

    def __init__(self, path: Path, columns: Columns) -> None:
        fields = [(name, _TYPES[of]) for name, of in columns.head]
        fields += [(name, pa.float64()) for name in columns.numbers]
        fields += [(name, pa.list_(pa.float64())) for name in columns.lists]
        self._schema = pa.schema(fields)
        self._writer = pq.ParquetWriter(path, self._schema, compression="zstd")
        self._rows: list[tuple[list[Any], list[float], list[list[float]]]] = []

    def append(self, item: ExportedMessage) -> None:
        self._rows.extend(list_rows(item))
        if len(self._rows) >= _BATCH:
            self._flush()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            self._flush()
            self._writer.close()
        else:  # the file is given up, and the first error is the one to report
            with suppress(OSError, pa.ArrowException):
                self._writer.close()

    def _flush(self) -> None:
        if not self._rows:
            return
        heads, numbers, lists = zip(*self._rows, strict=True)
        columns: list[Any] = list(zip(*heads, strict=True))
        columns += list(np.array(numbers, dtype=np.float64).T)
        columns += list(zip(*lists, strict=True))
        self._writer.write_batch(
            pa.record_batch(
                [
                    pa.array(column, field.type, from_pandas=True)
                    for column, field in zip(columns, self._schema, strict=True)
                ],
                schema=self._schema,
            )
        )
        self._rows.clear()
