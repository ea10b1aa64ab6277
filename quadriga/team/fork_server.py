"""Processes that share what they import: forked from a program that has imported it once.

An interpreter that starts and imports keeps a core busy for a second, and an agent that loads its
machine code for almost as long. A team on one computer is half a dozen of them, which share its
cores. This module is that program, and how it is asked. A process that starts one team after the
other keeps its fork server between them.
"""

from __future__ import annotations

import atexit
import ctypes
import gc
import importlib
import json
import os
import runpy
import select
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Final, NamedTuple, NoReturn

from quadriga.shared.runtime.installed import PYTHON, code_digest, package_versions
from quadriga.shared.runtime.signals import die_with_parent

# What each command imports once it is called, by the command.
_IMPORTED: Final = {
    "agent": ("quadriga.agents.process",),
    "bridge": ("quadriga.plant.process", "quadriga.team.plants"),
    "operate": ("quadriga.team.operator",),
    "plan": ("quadriga.agents.central_process",),
    "record": ("quadriga.recorder.process",),
    "router": ("quadriga.team.router",),
    "sim": ("quadriga.plant.process", "quadriga.team.plants", "quadriga.sim_server.world.world"),
}
_LARGEST: Final = 1 << 17  # bytes of an order, or of the answer to it
_COMM: Final = Path("/proc/self/comm")  # the name of a process: its first 15 bytes count
_PR_SET_CHILD_SUBREAPER: Final = 36  # linux/prctl.h
_PR_GET_CHILD_SUBREAPER: Final = 37
# What threadpoolctl sets where it is imported, and pytest for each test; nothing else reads them.
_IGNORED: Final = {"KMP_DUPLICATE_LIB_OK", "PYTEST_CURRENT_TEST"}
_one_at_a_time = threading.Lock()  # whether a process adopts is one word of it all
_kept: list[ForkServer] = []  # one at most, and this process's own
os.register_at_fork(after_in_child=_kept.clear)


class Fork(NamedTuple):
    """A process that is to be: the words behind `quadriga`, and the file for its output."""

    words: tuple[str, ...]
    log: str


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
        if self.poll() is None:
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
                (*PYTHON, "-m", __name__, str(os.getpid()), *commands),
                stdin=theirs.fileno(),
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                env=environment,
                start_new_session=True,
            )

    def fits(self, environment: Mapping[str, str]) -> bool:
        """Whether it runs, and starts what this process would start with this environment."""
        return self._made_for == _surroundings(environment) and self._process.poll() is None

    def start(self, forks: Sequence[Fork], go: int) -> list[int]:
        """Process ids of forks, which wait for a byte each from the pipe `go`.

        There are none where the server has failed, or the system permits no more processes.
        """
        try:
            socket.send_fds(self._line, [json.dumps(forks).encode()], [go])
            return list(json.loads(self._line.recv(_LARGEST) or b"[]"))
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
    return os.getcwd(), os.readlink("/proc/thread-self/ns/net"), variables


def expect_forks(commands: Collection[str], environment: Mapping[str, str]) -> None:
    """Have what these commands need imported, beside whatever is done until they are started."""
    with _one_at_a_time:
        _fitting_server(commands, environment)


def start_forked(forks: Sequence[Fork], environment: Mapping[str, str]) -> list[ForkedProcess]:
    """Start processes that share what they import, each in a session of its own.

    Children of this process, in the order of the forks; none if there can be none.
    """
    go, begin = os.pipe()
    try:
        with _one_at_a_time, _adopting():
            server = _fitting_server({fork.words[0] for fork in forks}, environment)
            pids = list[int]()
            try:
                pids = server.start(forks, go)
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


def main() -> NoReturn:
    """Answer each order with the process ids, a list in JSON, until there is nobody to order."""
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGTERM})
    die_with_parent(int(sys.argv[1]))
    line, ready = socket.socket(fileno=os.dup(0)), set[str]()
    _prepare(sys.argv[2:], ready)
    while True:
        text, handles, _, _ = socket.recv_fds(line, _LARGEST, 1)
        if not text:
            os._exit(0)
        forks = [Fork(tuple(words), log) for words, log in json.loads(text)]
        _prepare({fork.words[0] for fork in forks}, ready)
        read, write = os.pipe()
        between = os.fork()  # it ends at once, so whoever has ordered its children adopts them
        if between == 0:
            line.close()
            _fork_all(forks, write, handles[0])
        os.close(write)
        os.close(handles[0])
        with open(read, "rb") as said:  # until the last fork has closed it too
            pids = said.read()
        os.waitpid(between, 0)  # only now are they adopted, and can be waited for
        line.send(pids or b"[]")


def _prepare(commands: Collection[str], ready: set[str]) -> None:
    """Import, load and find out what these need that are not `ready` yet."""
    if not ready:
        importlib.import_module("quadriga.commands.parser").build_parser()
        code_digest()  # of the files that are imported here: forks must not read later ones
        package_versions()
    for command in {*commands} - ready:
        ready.add(command)
        for module in _IMPORTED.get(command, ()):
            importlib.import_module(module)
        if command == "agent":
            importlib.import_module("quadriga.warm_up").load_compiled()
    gc.freeze()  # or the first collection of each fork copies all pages


def _fork_all(forks: Sequence[Fork], say: int, go: int) -> NoReturn:
    """Fork all and say their process ids; none runs if the system permits no more processes."""
    pids = list[int]()
    for fork in forks:
        try:
            pids.append(os.fork())
        except OSError:
            for started in pids:
                os.kill(started, signal.SIGKILL)
            os._exit(1)
        if pids[-1] == 0:
            os.close(say)
            _become(fork, go)
    os.write(say, json.dumps(pids).encode())
    os._exit(0)


def _become(fork: Fork, go: int) -> NoReturn:
    """Be the fork's command once it may begin; end if nobody is left to say so."""
    os.setsid()
    log = os.open(fork.log, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o666)
    for opened, file in ((os.open(os.devnull, os.O_RDONLY), 0), (log, 1), (log, 2)):
        os.dup2(opened, file)
    if not os.read(go, 1):
        os._exit(0)
    os.close(go)
    _COMM.write_text(f"quadriga {fork.words[0]}", encoding="ascii")  # as `top` shows it
    sys.argv[1:] = fork.words
    importlib.invalidate_caches()  # there may be files that were not when they were filled
    runpy.run_module("quadriga", run_name="__main__", alter_sys=True)
    os._exit(0)  # it has ended the process


if __name__ == "__main__":
    main()
