"""Compilation of the 1 kHz arithmetic; the same functions run uncompiled when numba is told so."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from typing import Any, Final, TypeVar, cast

import numba
from numba.core import caching

from quadriga.shared.runtime.jit_cache import compiled_folder

F = TypeVar("F", bound=Callable[..., object])

_DIGEST: Final = sha256().digest_size


class _CheckedFiles(caching.IndexDataCacheFile):  # type: ignore[misc]
    """numba's files of machine code, with digests: what is damaged counts as not compiled yet.

    A crash or a full disk leaves files that are empty or cut; numba would raise whatever pickle
    does, or run what is left of a function.
    """

    def _load_index(self) -> Any:
        with suppress(Exception):  # pickle raises anything
            return super()._load_index()
        return {}

    def _load_data(self, name: str) -> Any:
        found = Path(self._data_path(name)).read_bytes()
        if sha256(found[_DIGEST:]).digest() != found[:_DIGEST]:
            raise OSError(f"{name} is damaged")  # as if it had been removed
        return pickle.loads(found[_DIGEST:])

    def _save_data(self, name: str, data: Any) -> None:
        code = self._dump(data)
        with self._open_for_write(self._data_path(name)) as file:
            file.write(sha256(code).digest() + code)

    def save(self, key: Any, data: Any) -> None:
        with suppress(OSError):  # a disk that has filled up meanwhile
            super().save(key, data)


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
    caching.IndexDataCacheFile = _CheckedFiles
