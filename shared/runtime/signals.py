"""Signals: SIGINT and SIGTERM raise a flag that loops check; no process outlives its parent."""

from __future__ import annotations

import ctypes
import os
import select
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from types import FrameType
from typing import Final

from quadriga.shared.runtime.clock import sleep

_STOPS: Final = (signal.SIGINT, signal.SIGTERM)
_IMPORTS: Final = "<frozen importlib"  # how the files begin whose functions import
_AGAIN: Final = 0.02  # s, after which an interrupt that came at a bad moment is tried again
_PR_SET_PDEATHSIG: Final = 1  # linux/prctl.h
_PATIENCE: Final = 90.0  # s; a bridge may take 72 to lay its robot down and leave


class StopFlag:
    """False until the process is asked to stop. Call it to read it."""

    def __init__(self) -> None:
        self._raised = False

    def __call__(self) -> bool:
        """Whether the process has been asked to stop."""
        return self._raised

    def set(self, *_: object) -> None:
        """Ask the process to stop; takes what a signal's handler is given."""
        self._raised = True


def stop_on_signals() -> StopFlag:
    """A flag that SIGINT and SIGTERM set from now on, instead of ending the process at once."""
    flag = StopFlag()
    for number in _STOPS:
        signal.signal(number, flag.set)
    return flag


@contextmanager
def _handled(handle: Callable[[int, FrameType | None], object]) -> Iterator[None]:
    """Within the block `handle` is called with SIGINT and SIGTERM, if this is the main thread."""
    before = {number: signal.signal(number, handle) for number in _STOPS if _is_main_thread()}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _is_main_thread() -> bool:
    return threading.current_thread() is threading.main_thread()


@contextmanager
def stop_flag() -> Iterator[StopFlag]:
    """A flag that SIGINT and SIGTERM set within the block; never that of another thread."""
    flag = StopFlag()
    with _handled(flag.set):
        yield flag


@contextmanager
def interruptible(stopped: Callable[[], bool]) -> Iterator[None]:
    """Within the block a stop raises KeyboardInterrupt at once: it looks at no flag for long.

    To compile takes a minute, in which a process would else go on that nobody waits for.

    Args:
        stopped: of `stop_on_signals`; any other is asked before the block only.

    Raises:
        KeyboardInterrupt: the process is to stop, or was to before the block.
    """
    with _handled(_interrupt) if isinstance(stopped, StopFlag) else nullcontext():
        if stopped():
            raise KeyboardInterrupt
        yield


def interrupt_on_sigterm() -> None:
    """Have SIGTERM raise KeyboardInterrupt, as SIGINT does, so that `with` blocks clean up.

    Both are let through from now on; one that was held back raises here. One that comes while a
    module is imported raises once that is over: what is half set up would show a traceback of its
    own, or swallow it. One that Python loses, since it came while a library called back, raises
    again.
    """
    shown = sys.unraisablehook

    def show_or_repeat(lost: sys.UnraisableHookArgs) -> None:
        if issubclass(lost.exc_type, KeyboardInterrupt):
            signal.setitimer(signal.ITIMER_REAL, _AGAIN)
        else:
            shown(lost)

    sys.unraisablehook = show_or_repeat
    signal.signal(signal.SIGALRM, lambda _number, _frame: signal.raise_signal(signal.SIGINT))
    for number in _STOPS:  # SIGINT too: a script's background job is started with it ignored
        signal.signal(number, _interrupt)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _STOPS)


def _interrupt(_number: int, frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt, or try again in a while if a module is being imported."""
    while frame is not None:
        if frame.f_code.co_filename.startswith(_IMPORTS):
            signal.setitimer(signal.ITIMER_REAL, _AGAIN)
            return
        frame = frame.f_back
    raise KeyboardInterrupt


def die_with_parent(parent: int) -> None:
    """Have the kernel send SIGTERM to this process when `parent`, which started it, dies.

    If it has died before this call, the signal is raised here: the kernel sends none any more.
    """
    ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM, 0, 0, 0)
    if os.getppid() != parent:
        os.kill(os.getpid(), signal.SIGTERM)


def kill_if_orphaned(parent: int, patience: float = _PATIENCE) -> None:
    """Have this process killed if it still runs `patience` seconds after `parent` has died.

    It may be busy in a library, or wait for a lock: then it heeds no signal that it can handle.
    """

    def outlive() -> None:
        with suppress(ProcessLookupError):  # it is gone already
            ended = os.pidfd_open(parent)
            if os.getppid() == parent:
                select.select([ended], [], [])  # without a wake-up
        sleep(patience)
        said = f"killed {patience:g} s after process {parent}, which had started this one"
        print(f"quadriga: {said}", file=sys.stderr, flush=True)
        os.kill(os.getpid(), signal.SIGKILL)

    threading.Thread(target=outlive, daemon=True).start()


@contextmanager
def interrupts_held() -> Iterator[None]:
    """Deliver SIGINT and SIGTERM only after the block; processes started in it know no SIGINT.

    For workers: Ctrl-C, which the terminal sends to all, is their parent's to handle. A worker
    inherits the blocked signal, so there is no moment, not even among its first imports, at which
    it would be hit. The parent's other threads do not block it; so it is noted here, and raised at
    the end. Of another thread than the main one, which signals do not reach, nothing is held.
    """
    if not _is_main_thread():
        yield
        return
    noted: list[int] = []
    try:
        with _handled(lambda received, _frame: noted.append(received)):
            before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
            try:
                yield
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, before)
    finally:
        if noted:
            signal.raise_signal(noted[0])
