"""Where an export goes."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

Progress = Callable[[int], None]  # told the tick that was reached


def remove(out: Path) -> None:
    """Take back an export that was not finished."""
    if out.is_dir():
        shutil.rmtree(out, ignore_errors=True)
    else:
        with suppress(OSError):  # it was never there
            out.unlink()


def file_of(out: Path, name: str, suffix: str) -> Path:
    """The file of a key without its team: `r1/state` is r1.state.csv."""
    return out / f"{name.replace('/', '.')}.{suffix}"
