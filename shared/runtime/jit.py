"""Compilation of the 1 kHz arithmetic; the same functions run uncompiled when numba is told so."""

from __future__ import annotations

import hashlib
import os
import shutil
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Final, TypeVar, cast

import numba

from quadriga.shared.runtime.imports import followed_files
from quadriga.shared.runtime.jit_references import count_references_plainly
from quadriga.shared.runtime.places import SOURCE, cache_dir

F = TypeVar("F", bound=Callable[..., object])

_PACKAGES: Final = ("agents", "bridges", "shared", "sim_server")
_MARK: Final = "\n@compiled"


def compiled(function: F) -> F:
    """Compile `function` with numba and keep the machine code on disk for the next process.

    Where no folder can be written to, each process compiles for itself.
    NUMBA_DISABLE_JIT=1 leaves it plain Python. `fastmath` stays off: results must not depend
    on how the compiler reorders sums.
    """
    return cast(F, numba.njit(cache=_KEPT)(function))


def sources(root: Path) -> Sequence[Path]:
    """Files that machine code is made of: those with compiled functions, and all they import.

    Args:
        root: the folder of this project's package `quadriga`.

    Raises:
        QuadrigaError: no file has compiled functions.
    """
    files = (path for name in _PACKAGES for path in (root / "quadriga" / name).rglob("*.py"))
    marked = (path for path in files if _MARK in path.read_text(encoding="utf-8"))
    return followed_files(
        root, (".".join(path.relative_to(root).with_suffix("").parts) for path in marked)
    )


@lru_cache(maxsize=1)
def digest() -> str:
    """Digest of all that machine code is made of, compiler included."""
    made_of = hashlib.sha256(f"{numba.__version__} {sys.version}".encode())
    for path in sources(SOURCE):
        made_of.update(path.read_bytes())
    return made_of.hexdigest()[:16]


def _key_by_all_sources() -> bool:
    """Keep machine code by all it is made of; False if no folder for it can be written to.

    numba looks at a function's own file alone: after a change of a function that it calls, or of a
    constant from another file, it would go on with the old code.
    """
    given = numba.config.CACHE_DIR  # NUMBA_CACHE_DIR
    bases = (
        [Path(given)] if given else [SOURCE / "quadriga" / "shared" / "__pycache__", cache_dir()]
    )
    for base in bases:  # the user's own where the code cannot be written to
        folder = base / f"compiled-{digest()}"
        with suppress(OSError):
            if not folder.exists():
                for old in {*base.glob("compiled-*")} - {folder}:
                    shutil.rmtree(old, ignore_errors=True)
            folder.mkdir(parents=True, exist_ok=True)
            if os.access(folder, os.W_OK):
                numba.config.CACHE_DIR = str(folder)
                return True
    return False


count_references_plainly()
_KEPT: Final = _key_by_all_sources()
