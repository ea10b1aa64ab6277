"""Calls side by side in processes of their own, all of which an interrupt ends."""

from __future__ import annotations

import multiprocessing
import os
import sys
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import resource_tracker
from queue import SimpleQueue
from threading import Lock
from types import ModuleType
from typing import Final, TypeVar

from quadriga.shared.errors import ProcessError
from quadriga.shared.runtime.signals import die_with_parent, interrupts_held

A = TypeVar("A")
B = TypeVar("B")

SAFE_PATH: Final = "PYTHONSAFEPATH"  # of the environment: `-P` for a process that is spawned
_HIDDEN: Final = Lock()  # held by the thread that has hidden the script


def run_each(
    call: Callable[[A], B], arguments: Sequence[A], jobs: int
) -> Generator[tuple[A, B], None, None]:
    """Each argument with what `call` returns for it, in the order in which they are done.

    Args:
        call: a function of a module, so that another process finds it.
        arguments: what to call it with.
        jobs: processes at a time.

    Raises:
        ProcessError: a process died.
    """
    # Spawn: a forked child would share the parent's threads' locks.
    context = multiprocessing.get_context("spawn")
    with _script_hidden():
        resource_tracker.ensure_running()  # before signals are held: its start lets them through
    begins = (os.getpid(), os.environ.get(SAFE_PATH))
    with ProcessPoolExecutor(jobs, context, _begin, begins) as pool:
        try:
            # Not `as_completed`: interrupted while it holds every future's lock, it leaves them
            # locked, and the pool waits for them for ever.
            done: SimpleQueue[Future[B]] = SimpleQueue()
            with interrupts_held(), _script_hidden():
                futures = {pool.submit(call, argument): argument for argument in arguments}
                for future in futures:
                    future.add_done_callback(done.put)
            for _ in arguments:
                future = done.get()
                yield futures[future], future.result()
        except BrokenProcessPool:
            raise ProcessError(
                "a worker process",
                "its death",
                "an answer",
                "killed, perhaps because memory was short",
            ) from None
        except BaseException:  # an interrupt: the pool would first finish every call
            for worker in multiprocessing.active_children():
                worker.terminate()
            raise


def _begin(parent: int, safe_path: str | None) -> None:
    die_with_parent(parent)
    _set_safe_path(safe_path)  # as the user has it, for the user's programs


@contextmanager
def _script_hidden() -> Iterator[None]:
    """Processes that are started within the block do not run the caller's script anew.

    A process that is spawned imports the main module of its parent, in case what it is to call
    stands there. Here it never does; and a script without `if __name__ == "__main__"` would walk
    a team in each of the processes that it merely waits for. Nor do they import from the working
    directory.
    """
    with _HIDDEN:
        script, safe_path = sys.modules["__main__"], os.environ.get(SAFE_PATH)
        sys.modules["__main__"] = ModuleType("__main__")
        _set_safe_path("1")
        try:
            yield
        finally:
            sys.modules["__main__"] = script
            _set_safe_path(safe_path)


def _set_safe_path(value: str | None) -> None:
    if value is None:
        os.environ.pop(SAFE_PATH, None)
    else:
        os.environ[SAFE_PATH] = value
