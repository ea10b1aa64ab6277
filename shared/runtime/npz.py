"""Reading files of arrays that NumPy wrote, and that something may have damaged since."""

from __future__ import annotations

import lzma
import struct
import tokenize
import warnings
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.lib.npyio import NpzFile
from numpy.typing import NDArray

_LARGEST: Final = 1 << 31  # bytes of all arrays together
_ARCHIVE: Final = b"PK\x03\x04"  # else NumPy takes it for a bare array, of any size
_GREATEST: Final = 1e15  # that anything measured can be, whatever its unit
_NUMBERS: Final = "fiu"  # NumPy's kinds of types

# What NumPy, its parsers and the archive's raise on bytes that are damaged, and what checks of the
# content raise. A traceback would help nobody: the bytes are wrong, not the program.
UNREADABLE: Final = (
    *(OSError, ValueError, TypeError, LookupError, AttributeError, EOFError, RuntimeError),
    *(ArithmeticError, MemoryError, SyntaxError, Warning, struct.error, zlib.error),
    *(lzma.LZMAError, tokenize.TokenError, zipfile.BadZipFile),
)


def as_measured(
    name: str, array: Any, axes: int, *, gaps: bool = False, most: float = _GREATEST
) -> NDArray[np.float64]:
    """An array of a file as measured numbers, of any unit.

    Args:
        name: its own.
        array: what the file has; bytes if that is no array.
        axes: how many it should have.
        gaps: whether it may hold NaN, of what could not be measured.
        most: that a number may be, and less than nothing as much.

    Raises:
        one of UNREADABLE: it has others, or holds what is no number that can be computed with.
    """
    found = np.asarray(array)
    if found.dtype.kind not in _NUMBERS:
        raise ValueError(f"{name} of {found.dtype}")
    numbers = np.ascontiguousarray(found, dtype=np.float64)
    fine = np.abs(numbers) <= most
    if gaps:
        fine |= np.isnan(numbers)
    if numbers.ndim != axes or not fine.all():
        raise ValueError(f"{name} of shape {numbers.shape}, or what nobody measures in it")
    return numbers


@contextmanager
def open_npz(path: Path) -> Iterator[NpzFile]:
    """The archive of arrays in a file; they are read when they are asked for.

    Raises:
        one of UNREADABLE: no such file, no archive, one that is damaged, or one that unpacks to
            more than it should.
    """
    # An own handle: NumPy leaves its open when the archive turns out to be broken.
    with path.open("rb") as file, warnings.catch_warnings():
        warnings.simplefilter("error")  # of a header that is not as NumPy writes it
        if file.read(len(_ARCHIVE)) != _ARCHIVE:
            raise ValueError("no archive of arrays")
        file.seek(0)
        with np.load(file, allow_pickle=False) as archive:
            size = sum(member.file_size for member in archive.zip.infolist())
            if size > _LARGEST:
                raise ValueError(f"arrays of {size:,} bytes")
            yield archive
