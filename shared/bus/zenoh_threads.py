"""How many threads Zenoh takes in a member of a team, which has a part of a core for them all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

_VARIABLE: Final = "ZENOH_RUNTIME"  # read by Zenoh when a process opens its first session
_ONE_RECEIVES: Final = "(rx: (worker_threads: 1))"


@contextmanager
def one_thread_receives() -> Iterator[None]:
    """Within the block a session is opened that receives in one thread, where Zenoh has two.

    Every message is handed over to Python, which one thread at a time can do: two threads wake each
    other up and wait for each other. Whoever has set the variable decides; processes that this one
    starts, a router perhaps, do not inherit it.
    """
    if _VARIABLE in os.environ:
        yield
        return
    os.environ[_VARIABLE] = _ONE_RECEIVES
    try:
        yield
    finally:
        del os.environ[_VARIABLE]
