"""The number of threads that linear algebra uses: results must not depend on the machine."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

# The libraries must be loaded to be told; what loads them later is not.
import numpy as np  # noqa: F401
import scipy.linalg  # noqa: F401
from threadpoolctl import ThreadpoolController, threadpool_limits


def use_one_blas_thread() -> None:
    """Hold BLAS to one thread from now on.

    It sums in another order with another number of threads, so that the last bits of a plan would
    tell how many cores the machine has; and agents on one machine would fight for them.
    """
    threadpool_limits(limits=1)


@contextmanager
def blas_threads_kept() -> Iterator[None]:
    """Whatever happens within the block, BLAS has the caller's number of threads after it."""
    before = {library.filepath: library.num_threads for library in _libraries()}
    try:
        yield
    finally:
        for library in _libraries():
            if library.filepath in before:
                library.set_num_threads(before[library.filepath])


def _libraries() -> list[Any]:
    """What sums with threads of its own, of all that is loaded now."""
    return list(ThreadpoolController().lib_controllers)
