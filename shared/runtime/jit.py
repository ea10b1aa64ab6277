"""Compilation of the 1 kHz arithmetic; the same functions run uncompiled when numba is told so."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import TypeVar, cast

import numba

from quadriga.shared.runtime.jit_cache import compiled_folder

F = TypeVar("F", bound=Callable[..., object])


def compiled(function: F) -> F:
    """Compile `function` with numba and keep the machine code on disk for the next process.

    Where no folder can be written to, each process compiles for itself.
    NUMBA_DISABLE_JIT=1 leaves it plain Python. `fastmath` stays off: results must not depend
    on how the compiler reorders sums.
    """
    with suppress(RuntimeError):  # the folder's disk is full
        return cast(F, numba.njit(cache=_FOLDER is not None)(function))
    return cast(F, numba.njit(function))


if (_FOLDER := compiled_folder()) is not None:
    numba.config.CACHE_DIR = str(_FOLDER)
    # No other folder: numba would not compile anew there what calls a function that has changed.
    numba.config.CACHE_LOCATOR_CLASSES = "UserProvidedCacheLocator"
