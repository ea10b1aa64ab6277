"""Files that are there whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


@contextmanager
def atomic_write(path: Path) -> Iterator[Path]:
    """A path to write to, whose file becomes `path` when the block ends.

    It is on the disk before it has the name. If the block fails, or writes nothing, `path` stays
    as it was. Two processes that write the same file do not disturb each other. A link goes on to
    lead to the file; what is none, such as /dev/stdout, is written to as it is.

    Raises:
        OSError: the file cannot be written; it names `path`.
    """
    if path.exists() and not path.is_file():
        yield path
        return
    named, path = path, path.resolve()
    partial = path.with_name(f"{path.name}.{os.getpid()}.partial")
    try:
        yield partial
        if partial.exists():
            with partial.open("rb") as file:
                os.fsync(file.fileno())
            partial.replace(path)
    except OSError as error:
        if error.filename in (None, str(partial)):  # of a full disk the system names no file
            error.filename = str(named)
        raise
    finally:
        with suppress(OSError):  # where nothing can be written nothing can be removed
            partial.unlink(missing_ok=True)


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file that is there whole or not at all."""
    with atomic_write(path) as partial:
        partial.write_bytes(content)


def write_text(path: Path, text: str) -> None:
    """Write a file in UTF-8 that is there whole or not at all."""
    write_bytes(path, text.encode("utf-8"))
