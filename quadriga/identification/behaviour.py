"""What code does, as a digest: of the numbers that it gives on a fixed set of samples.

Names, comments and layout change no digest; a gain, a constant or the order of a sum does. Who
asks need not run the samples: their digest is kept in the user's cache, by all it depends on.
"""

from __future__ import annotations

import fcntl
import hashlib
import platform
from collections.abc import Iterable
from functools import cache
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Final

import numpy as np

from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.arithmetic import arithmetic_digest
from quadriga.shared.runtime.atomic import write_text
from quadriga.shared.runtime.installed import digest_files
from quadriga.shared.runtime.jit_cache import followed_files
from quadriga.shared.runtime.places import SOURCE, cache_dir

_LIBRARIES: Final = (
    "mujoco",
    "pin",
    "numpy",
    "scipy",
    "numba",
    "daqp",
    "osqp",
    "example-robot-data",
)
_KEPT: Final = 20  # digests of earlier code in the cache: a few for who goes back and forth


@cache
def behaviour(module: str) -> str:
    """Digest of the numbers that a module's `samples` give; 16 hexadecimal digits.

    They are run only if no process of this machine has run them with this code, these libraries
    and this arithmetic before; a process that finds another at it waits.

    Args:
        module: whose `samples()` gives arrays of any shape, the same ones each time; all it imports
            is the code that the digest depends on. It is imported only if they are run.

    Raises:
        QuadrigaError: there is no such module.
    """
    folder = cache_dir() / "behaviour"
    cached = folder / f"{module.rpartition('.')[2]}-{_origin(module)}"
    if cached.is_file():
        return cached.read_text(encoding="ascii")
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / ".lock").open("wb") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not cached.is_file():
            write_text(cached, digest_of(import_module(module).samples()))
            _forget(cached)
    return cached.read_text(encoding="ascii")


def digest_of(arrays: Iterable[Array]) -> str:
    """Digest of numbers and of nothing else; 16 hexadecimal digits."""
    digest = hashlib.sha256()
    for array in arrays:
        digest.update(np.ascontiguousarray(array, dtype="<f8").tobytes())
    return digest.hexdigest()[:16]


def numbers(*values: float | None) -> Array:
    """Numbers as an array, NaN for those that there are not."""
    return np.array([np.nan if value is None else value for value in values], dtype=float)


@cache
def sources_digest(module: str) -> str:
    """Digest of the text of a module and of all that it imports; 16 hexadecimal digits."""
    files = followed_files(SOURCE, [module])
    return digest_files((path.relative_to(SOURCE), path) for path in files)


def _origin(module: str) -> str:
    """Digest of all that numbers depend on: sources, libraries, and the machine's arithmetic."""
    versions = [platform.python_version(), *(f"{name} {version(name)}" for name in _LIBRARIES)]
    text = f"{sources_digest(module)} {arithmetic_digest()} {versions}"
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _forget(cached: Path) -> None:
    stem = cached.name.rpartition("-")[0]
    files = sorted(cached.parent.glob(f"{stem}-*"), key=lambda path: path.stat().st_mtime_ns)
    for old in files[:-_KEPT]:
        old.unlink(missing_ok=True)
