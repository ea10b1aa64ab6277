"""The number of threads that linear algebra uses: results must not depend on the machine."""

from __future__ import annotations

# The libraries must be loaded to be told; what loads them later is not.
import numpy as np  # noqa: F401
import scipy.linalg  # noqa: F401
from threadpoolctl import threadpool_limits


def use_one_blas_thread() -> None:
    """Hold BLAS to one thread from now on.

    It sums in another order with another number of threads, so that the last bits of a plan would
    tell how many cores the machine has; and agents on one machine would fight for them.
    """
    threadpool_limits(limits=1)
