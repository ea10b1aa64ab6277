"""Processes that a fork server starts, and that become this process's own children."""

from __future__ import annotations

import ctypes
import json
import os
import select
import signal
import subprocess
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Final

from quadriga.team.fork_server import Fork, ForkOrder, command_line

_PR_SET_CHILD_SUBREAPER: Final = 36  # linux/prctl.h
_PR_GET_CHILD_SUBREAPER: Final = 37
_one_at_a_time = threading.Lock()  # whether a process adopts is one word of it all


class ForkedProcess:
    """A child of this process: what `subprocess.Popen` offers of one that it has started."""

    def __init__(self, pid: int) -> None:
        self.pid = pid
        self.returncode: int | None = None  # once it is known that it has ended

    def poll(self) -> int | None:
        """Its exit status, or minus the signal that ended it; None while it runs."""
        if self.returncode is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                self.returncode = os.waitstatus_to_exitcode(status)
        return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        """Its exit status, once it has ended.

        Raises:
            TimeoutExpired: it still runs after so many seconds.
        """
        status = self.poll()
        if status is None:
            ended = os.pidfd_open(self.pid)
            try:
                select.select([ended], [], [], timeout)
            finally:
                os.close(ended)
            status = self.poll()
        if status is None:
            raise subprocess.TimeoutExpired(f"process {self.pid}", timeout or 0.0)
        return status

    def terminate(self) -> None:
        """Send it SIGTERM, if it still runs."""
        self._send(signal.SIGTERM)

    def kill(self) -> None:
        """Send it SIGKILL, if it still runs."""
        self._send(signal.SIGKILL)

    def _send(self, number: int) -> None:
        if self.poll() is None:  # else its number may be another's by now
            os.kill(self.pid, number)


def start_forked(
    forks: Sequence[Fork], prefix: int, environment: Mapping[str, str]
) -> list[ForkedProcess]:
    """Start processes that share what they import.

    Args:
        forks: their command lines, which begin with the same words, and logs.
        prefix: how many words those are: an interpreter and how it starts this project.
        environment: theirs.

    Returns:
        One child of this process for each, in a session of its own; none if there can be none.
    """
    go, begin = os.pipe()
    try:
        with _one_at_a_time, _adopting():
            pids = _fork(ForkOrder(prefix, go, tuple(forks)), environment)
        os.write(begin, b"." * len(pids))
    finally:
        os.close(go)
        os.close(begin)
    return [ForkedProcess(pid) for pid in pids]


def _fork(order: ForkOrder, environment: Mapping[str, str]) -> list[int]:
    server = subprocess.Popen(
        command_line(order.forks),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env=environment,
        pass_fds=(order.go,),
        start_new_session=True,
        text=True,
    )
    try:
        said, _ = server.communicate(order.to_json())
    except BaseException:  # interrupted: what it has forked ends by itself, without a start
        server.kill()
        server.wait()
        raise
    return [int(pid) for pid in json.loads(said)] if server.returncode == 0 else []


@contextmanager
def _adopting() -> Iterator[None]:
    """Within the block this process becomes the parent of what its children leave behind."""
    libc, before = ctypes.CDLL(None, use_errno=True), ctypes.c_int()
    libc.prctl(_PR_GET_CHILD_SUBREAPER, ctypes.byref(before), 0, 0, 0)
    libc.prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    try:
        yield
    finally:
        libc.prctl(_PR_SET_CHILD_SUBREAPER, before.value, 0, 0, 0)
