"""Compiled functions count references to arrays without atomic operations."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba.core import config
from numba.core.runtime import nrtdynmod

_DEFINED_BY = "_define_atomic_inc_dec"  # numba's, of the one function that this replaces


def count_references_plainly() -> None:
    """Replace the atomic count, before numba compiles it; a numba without one stays as it is.

    Each view of an array and many a call of a function counts, and atomically that takes a quarter
    of a control tick. No two threads count at a time: a compiled function holds Python's lock while
    it runs, and none here is compiled with `nogil` or `parallel`. numba's own switch for this,
    `_disable_atomicity`, never frees an array (numba 0.62 to 0.68).
    """
    if hasattr(nrtdynmod, _DEFINED_BY):
        setattr(nrtdynmod, _DEFINED_BY, _define_count)


def _define_count(module: Any, operation: str, ordering: str) -> Any:
    """Define a function that counts up ("add") or down ("sub") by one and returns the count."""
    word = ir.IntType(config.MACHINE_BITS)
    signature = ir.FunctionType(word, [word.as_pointer()])
    function = ir.Function(module, signature, name=f"nrt_atomic_{operation}")
    builder = ir.IRBuilder(function.append_basic_block())
    place = function.args[0]
    count = getattr(builder, operation)(builder.load(place), ir.Constant(word, 1))
    builder.store(count, place)
    builder.ret(count)
    return function
