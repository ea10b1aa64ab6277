"""Program that becomes several processes of a team: it imports once what each of them needs.

An interpreter that starts and imports keeps a core busy for a second. A team on one computer is
half a dozen of them, which share its cores.
"""

from __future__ import annotations

import gc
import json
import os
import runpy
import signal
import sys
from dataclasses import asdict, dataclass
from importlib import import_module
from pathlib import Path
from typing import Final, NoReturn

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
_PROGRAM: Final = "quadriga"
_ARG_START: Final = 48  # field of /proc/PID/stat, see proc(5)


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
    """What this program is to do.

    Attributes:
        prefix: how many words of a command line come before the command's name.
        go: a pipe that is open for reading; a fork takes a byte from it before it begins.
        forks: in the order in which they begin.
    """

    prefix: int
    go: int
    forks: tuple[Fork, ...]

    def to_json(self) -> str:
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> ForkOrder:
        raw = json.loads(text)
        forks = (Fork(tuple(fork["words"]), fork["log"]) for fork in raw["forks"])
        return cls(raw["prefix"], raw["go"], tuple(forks))


def command_line(forks: tuple[Fork, ...]) -> tuple[str, ...]:
    """How this program is started for `forks`: its last word keeps room for their command lines."""
    room = max(len(_joined(fork.words)) for fork in forks)
    return (sys.executable, "-m", __name__, " " * room)


def main() -> None:
    """Read an order, fork, and write the process ids as a line of JSON."""
    order = ForkOrder.from_json(sys.stdin.read())
    import_module("quadriga.commands.parser")
    for command in dict.fromkeys(fork.words[order.prefix] for fork in order.forks):
        for module in _IMPORTED.get(command, ()):
            import_module(module)
    gc.freeze()  # or the first collection of each fork copies all pages
    pids: list[int] = []
    fork = _fork_all(order, pids)
    if fork is not None:
        _become(fork, order)
    print(json.dumps(pids), flush=True)


def _fork_all(order: ForkOrder, pids: list[int]) -> Fork | None:
    """What this process is to become if it is a fork; None for the program, which gets `pids`.

    Raises:
        OSError: the system permits no more processes; there is none then.
    """
    for fork in order.forks:
        try:
            pid = os.fork()
        except OSError:
            for started in pids:
                os.kill(started, signal.SIGKILL)
            raise
        if pid == 0:
            return fork
        pids.append(pid)
    return None


def _become(fork: Fork, order: ForkOrder) -> NoReturn:
    """Be the fork's command once it may begin; end if nobody is left to say so."""
    os.setsid()
    _redirect(fork.log)
    if not os.read(order.go, 1):
        os._exit(0)
    os.close(order.go)
    _show_words(fork.words)
    sys.argv[1:] = fork.words[order.prefix :]
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
