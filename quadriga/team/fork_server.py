"""Program that becomes the processes of a team, of one walk after the other.

An interpreter that starts and imports keeps a core busy for a second, and an agent that loads its
machine code for almost as long. A team on one computer is half a dozen of them, which share its
cores. So all that is done once, here, and whatever is forked has it.
"""

from __future__ import annotations

import gc
import importlib
import json
import os
import runpy
import signal
import socket
import sys
from collections.abc import Collection
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final, NoReturn

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
_AGENT: Final = "agent"
_PROGRAM: Final = "quadriga"
_ROOM: Final = 2_000  # bytes for the command line that a fork is shown with
_ARG_START: Final = 48  # field of /proc/PID/stat, see proc(5)
LARGEST: Final = 1 << 17  # bytes of an order, or of the answer to it


@dataclass(frozen=True, slots=True)
class Fork:
    """A process that is to be.

    Attributes:
        words: its command line, from the interpreter on.
        log: the file that its output is added to.
    """

    words: tuple[str, ...]
    log: str


@dataclass(frozen=True, slots=True)
class ForkOrder:
    """What this program is to become.

    With it comes a pipe that is open for reading: a fork takes a byte from it before it begins.

    Attributes:
        prefix: how many words of a command line come before the command's name.
        forks: in the order in which they begin.
    """

    prefix: int
    forks: tuple[Fork, ...]

    @property
    def commands(self) -> list[str]:
        """The commands of its forks."""
        return list(dict.fromkeys(fork.words[self.prefix] for fork in self.forks))

    def to_json(self) -> bytes:
        return json.dumps(asdict(self)).encode()

    @classmethod
    def from_json(cls, text: bytes) -> ForkOrder:
        raw = json.loads(text)
        forks = (Fork(tuple(fork["words"]), fork["log"]) for fork in raw["forks"])
        return cls(raw["prefix"], tuple(forks))


def command_line(line: int, commands: Collection[str]) -> tuple[str, ...]:
    """How this program is started.

    Args:
        line: number of its end of a pair of sockets, over which orders come.
        commands: what will be ordered first, as far as that is known.

    Returns:
        Words of which the last one keeps room for a fork's command line.
    """
    words = (str(line), str(os.getpid()), ",".join(commands))
    return (*PYTHON, "-m", __name__, *words, " " * _ROOM)


def main() -> NoReturn:
    """Answer each order with the process ids, a list in JSON, until there is nobody to order."""
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGTERM})
    number, parent, commands = sys.argv[1:4]
    die_with_parent(int(parent))
    line, ready = socket.socket(fileno=int(number)), set[str]()
    _prepare(commands.split(","), ready)
    while True:
        text, handles, _, _ = socket.recv_fds(line, LARGEST, 1)
        if not text:
            os._exit(0)
        order = ForkOrder.from_json(text)
        _prepare(order.commands, ready)
        pids, fork = _fork_apart(order)
        if fork is not None:
            line.close()
            _become(fork, order.prefix, handles[0])
        os.close(handles[0])
        line.send(json.dumps(pids).encode())


def _prepare(commands: Collection[str], ready: set[str]) -> None:
    """Import, load and find out what these need that are not `ready` yet."""
    if not ready:
        importlib.import_module("quadriga.commands.parser").build_parser()
        code_digest()  # of the files that are imported here: forks must not read later ones
        package_versions()
    for command in commands:
        if command in ready:
            continue
        ready.add(command)
        for module in _IMPORTED.get(command, ()):
            importlib.import_module(module)
        if command == _AGENT:
            importlib.import_module("quadriga.warm_up").load_compiled()
    gc.freeze()  # or the first collection of each fork copies all pages


def _fork_apart(order: ForkOrder) -> tuple[list[int], Fork | None]:
    """Fork all from a process in between, which ends: so whoever orders them can adopt them.

    Returns:
        Their process ids, none if the system permits no more processes, and None; or in a fork
        what it is to become.
    """
    read, write = os.pipe()
    between = os.fork()
    if between:
        os.close(write)
        with open(read, "rb") as said:  # until the last fork has closed it too
            pids = json.loads(said.read() or b"[]")
        os.waitpid(between, 0)
        return pids, None
    pids = []
    fork = _fork_all(order, pids)
    if fork is None:
        os.write(write, json.dumps(pids).encode())
        os._exit(0)
    os.close(read)
    os.close(write)
    return [], fork


def _fork_all(order: ForkOrder, pids: list[int]) -> Fork | None:
    """What this process is to become if it is a fork; None for who forks them, who gets `pids`.

    It ends if the system permits no more processes; there is none then.
    """
    for fork in order.forks:
        try:
            pid = os.fork()
        except OSError:
            for started in pids:
                os.kill(started, signal.SIGKILL)
                os.waitpid(started, 0)
            os._exit(1)
        if pid == 0:
            return fork
        pids.append(pid)
    return None


def _become(fork: Fork, prefix: int, go: int) -> NoReturn:
    """Be the fork's command once it may begin; end if nobody is left to say so."""
    os.setsid()
    _redirect(fork.log)
    if not os.read(go, 1):
        os._exit(0)
    os.close(go)
    _show_words(fork.words)
    sys.argv[1:] = fork.words[prefix:]
    importlib.invalidate_caches()  # there may be files that were not when they were filled
    runpy.run_module(_PROGRAM, run_name="__main__", alter_sys=True)
    os._exit(0)  # it has ended the process


def _redirect(log: str) -> None:
    """Read nothing, and add what is written to the log."""
    for opened, file in (
        (os.open(os.devnull, os.O_RDONLY), 0),
        (_append(log), 1),
        (_append(log), 2),
    ):
        os.dup2(opened, file)
        os.close(opened)


def _append(log: str) -> int:
    return os.open(log, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o666)


def _show_words(words: tuple[str, ...]) -> None:
    """Have `ps` show these words as this process's command line, in the place of the program's."""
    try:
        fields = Path("/proc/self/stat").read_text(encoding="ascii").rpartition(") ")[2].split()
        start, end = (int(fields[_ARG_START - 3 + n]) for n in range(2))
        shown = _joined(words)[: end - start]
        with open("/proc/self/mem", "r+b", buffering=0) as memory:
            memory.seek(start)
            memory.write(shown.ljust(end - start, b"\0"))
    except (OSError, ValueError, IndexError):
        return  # a system that keeps its memory to itself; the process does its work


def _joined(words: tuple[str, ...]) -> bytes:
    return b"".join(word.encode() + b"\0" for word in words)


if __name__ == "__main__":
    main()
