"""Processes that a fork server starts, and that become this process's own children.

A process that starts one team after the other keeps its fork server between them.
"""

from __future__ import annotations

import atexit
import ctypes
import json
import os
import select
import signal
import socket
import subprocess
import threading
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Final

from quadriga.team.fork_server import LARGEST, Fork, ForkOrder, command_line

_PR_SET_CHILD_SUBREAPER: Final = 36  # linux/prctl.h
_PR_GET_CHILD_SUBREAPER: Final = 37
# What threadpoolctl sets where it is imported, and pytest for each test; nothing else reads them.
_IGNORED: Final = {"KMP_DUPLICATE_LIB_OK", "PYTEST_CURRENT_TEST"}
_NETWORK: Final = "/proc/thread-self/ns/net"  # of this thread: its namespace
_one_at_a_time = threading.Lock()  # whether a process adopts is one word of it all
_kept: list[ForkServer] = []  # one at most, and this process's own
os.register_at_fork(after_in_child=_kept.clear)


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


class ForkServer:
    """A fork server that runs, and how it is asked.

    Args:
        commands: what will be ordered first, as far as that is known.
        environment: its own, and that of all that it starts.
    """

    def __init__(self, commands: Collection[str], environment: Mapping[str, str]) -> None:
        self._made_for = _surroundings(environment)
        self._line, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            self._process = subprocess.Popen(
                command_line(theirs.fileno(), commands),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                env=environment,
                pass_fds=(theirs.fileno(),),
                start_new_session=True,
            )

    def fits(self, environment: Mapping[str, str]) -> bool:
        """Whether it runs, and starts what this process would start with this environment."""
        return self._made_for == _surroundings(environment) and self._process.poll() is None

    def start(self, order: ForkOrder, go: int) -> list[int]:
        """Process ids of an order's forks, which wait for a byte each from the pipe `go`.

        There are none where the server has failed, or the system permits no more processes.
        """
        try:
            socket.send_fds(self._line, [order.to_json()], [go])
            return list(json.loads(self._line.recv(LARGEST) or b"[]"))
        except OSError:
            return []

    def close(self) -> None:
        """End it. What it has started goes on; what has not begun yet, never does."""
        self._line.close()
        self._process.kill()
        self._process.wait()


def _surroundings(environment: Mapping[str, str]) -> tuple[str, str, Mapping[str, str]]:
    """What a process that is started now gets: its folder, its network and its environment."""
    variables = {name: environment[name] for name in environment.keys() - _IGNORED}
    return os.getcwd(), os.readlink(_NETWORK), variables


def expect_forks(commands: Collection[str], environment: Mapping[str, str]) -> None:
    """Have what these commands need imported, beside whatever is done until they are started."""
    with _one_at_a_time:
        _fitting_server(commands, environment)


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
    order = ForkOrder(prefix, tuple(forks))
    go, begin = os.pipe()
    try:
        with _one_at_a_time, _adopting():
            server = _fitting_server(order.commands, environment)
            pids = list[int]()
            try:
                pids = server.start(order, go)
            finally:
                if not pids:  # it has failed, or its answer is not waited for
                    end_fork_server()
        os.write(begin, b"." * len(pids))
    finally:
        os.close(go)
        os.close(begin)
    return [ForkedProcess(pid) for pid in pids]


def _fitting_server(commands: Collection[str], environment: Mapping[str, str]) -> ForkServer:
    """The server that is kept, or a new one in its place if it does not fit."""
    if _kept and not _kept[0].fits(environment):
        end_fork_server()
    if not _kept:
        _kept.append(ForkServer(commands, environment))
    return _kept[0]


@atexit.register
def end_fork_server() -> None:
    """End the server that is kept, if there is one: no other team is to be started for now."""
    while _kept:
        _kept.pop().close()


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
