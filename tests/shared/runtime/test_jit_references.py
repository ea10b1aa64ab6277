"""Counts of references without atomic operations: every array is freed, none too early."""

from __future__ import annotations

import numba
import numpy as np
import pytest
from numba.core.runtime import _nrt_python, nrtdynmod, rtsys

from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.jit import compiled

pytestmark = pytest.mark.skipif(numba.config.DISABLE_JIT, reason="nothing is compiled")


@compiled
def _inner(rows: Array) -> Array:
    sums: Array = rows[1:] + rows[:-1]
    return sums


@compiled
def _sums(rows: Array, times: int) -> Array:
    """Makes arrays, views of them, and views that outlive what they are of."""
    kept: Array = rows[0]
    for _ in range(times):
        made = _inner(rows * 2.0)
        kept = made[0] + _inner(made)[-1]
    return kept


def test_what_is_made_is_freed_and_views_stay_whole() -> None:
    rows = np.arange(12.0).reshape(4, 3)
    doubled = 2.0 * (rows[1:] + rows[:-1])
    expected = doubled[0] + (doubled[1:] + doubled[:-1])[-1]
    assert np.array_equal(_sums(rows, 1), expected)
    _nrt_python.memsys_enable_stats()
    before = rtsys.get_allocation_stats()
    found = _sums(rows, 500)
    middle = rtsys.get_allocation_stats()
    assert np.array_equal(found, expected)
    del found
    after = rtsys.get_allocation_stats()
    assert middle.mi_alloc - before.mi_alloc > 1000
    assert after.mi_alloc - before.mi_alloc == after.mi_free - before.mi_free


def test_numba_still_has_what_is_replaced() -> None:
    """If not, counting is atomic again, and a quarter of a control tick slower."""
    assert nrtdynmod._define_atomic_inc_dec.__module__.endswith("jit_references")
