"""Calls side by side in processes of their own, which an interrupt leaves none of."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import resource_tracker
from typing import TypeVar

from shared.signals import die_with_parent, interrupts_held

A = TypeVar("A")
B = TypeVar("B")


def each_done(
    call: Callable[[A], B], arguments: Sequence[A], jobs: int
) -> Generator[tuple[A, B], None, None]:
    """Arguments with what `call` made of them, in the order in which they are done.

    Args:
        call: a function of a module, so that another process finds it.
        arguments: what to call it with.
        jobs: processes at a time.
    """
    # Spawn: a forked child would share the parent's threads' locks.
    context = multiprocessing.get_context("spawn")
    resource_tracker.ensure_running()  # before signals are held: its start lets them through
    with ProcessPoolExecutor(jobs, context, die_with_parent, (os.getpid(),)) as pool:
        try:
            with interrupts_held():
                futures = {pool.submit(call, argument): argument for argument in arguments}
            for future in as_completed(futures):
                yield futures[future], future.result()
        except BaseException:  # an interrupt: the pool would first finish every call
            for worker in multiprocessing.active_children():
                worker.terminate()
            raise
