"""Processes of a benchmark, which are ended even after an error or an interrupt."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import Any, Final

from quadriga.shared.config.sections import Config
from quadriga.shared.runtime.scheduling import take_priority
from quadriga.shared.runtime.signals import die_with_parent, interrupts_held

SPAWN: Final[SpawnContext] = multiprocessing.get_context("spawn")
_GRACE: Final = 10.0  # s


def child(target: Callable[..., None], *arguments: Any) -> SpawnProcess:
    """A process, not yet started, that calls `target` and dies with this one."""
    return SPAWN.Process(target=_live, args=(os.getpid(), target, arguments))


def _live(parent: int, target: Callable[..., None], arguments: tuple[Any, ...]) -> None:
    die_with_parent(parent)
    target(*arguments)


@contextmanager
def running(*processes: SpawnProcess) -> Iterator[None]:
    """Start the processes; at the end of the block wait for them, or end them after an error.

    Raises:
        ChildProcessError: one failed, or did not leave in time.
    """
    resource_tracker.ensure_running()  # started before signals are held, as its start releases them
    try:
        with interrupts_held():  # Ctrl-C reaches all processes, but only this one handles it
            for process in processes:
                process.start()
        yield
        for process in processes:
            process.join(_GRACE)
    finally:
        started = [process for process in processes if process.pid is not None]
        for process in started:
            process.terminate()
        for process in started:
            process.join(_GRACE)
            process.kill()
            process.join()
    if failed := [f"{p.name}: exit code {p.exitcode}" for p in processes if p.exitcode]:
        raise ChildProcessError(f"a process of the benchmark failed: {', '.join(failed)}")


def result_of(target: Callable[..., Any], *arguments: Any) -> Any:
    """The result of `target`, run in a process of its own that is scheduled like those of a walk.

    Raises:
        ChildProcessError: it crashed, or raised an error, which it has printed.
    """
    receiver, sender = SPAWN.Pipe(duplex=False)
    with running(child(_answer, sender, target, arguments)):
        sender.close()  # otherwise the end of the process would not be noticed
        try:
            return receiver.recv()
        except EOFError:
            raise ChildProcessError(f"{target.__name__} failed in a process of its own") from None


def _answer(sender: Connection, target: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    take_priority(Config().runtime.priority)
    sender.send(target(*arguments))
