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
from typing import Final

import numpy as np
from numpy.lib.npyio import NpzFile

_LARGEST: Final = 1 << 31  # bytes of all arrays together; those of ten robots take a tenth
_ARCHIVE: Final = b"PK\x03\x04"

# What NumPy, its parsers and the archive's raise on bytes that are damaged, and what checks of the
# content raise. A traceback would help nobody: the bytes are wrong, not the program.
UNREADABLE: Final = (
    OSError,
    ValueError,
    TypeError,
    LookupError,
    AttributeError,
    EOFError,
    RuntimeError,
    ArithmeticError,
    MemoryError,
    SyntaxError,
    Warning,
    struct.error,
    zlib.error,
    lzma.LZMAError,
    tokenize.TokenError,
    zipfile.BadZipFile,
)


@contextmanager
def open_npz(path: Path) -> Iterator[NpzFile]:
    """The archive of arrays in a file; they are read when they are asked for.

    Raises:
        one of UNREADABLE: no such file, no archive, one that is damaged, or one of more than 2 GiB.
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
