"""SHELL of the ways to stop a team: each is what a person has at hand, with its own process."""

from __future__ import annotations

import os
import pty
import struct
import subprocess
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import Final

from quadriga.drive.gamepad import STOP_BUTTON
from quadriga.shared.errors import ProcessError
from quadriga.shared.runtime.clock import monotonic, monotonic_ns, sleep
from quadriga.shared.runtime.installed import PYTHON
from quadriga.stop_times.page_driver import PageDriver
from quadriga.team.launch import QUADRIGA
from quadriga.team.run_folder import CONFIG
from quadriga.team.spectator import end_process

Press = Callable[[], int]  # presses; `monotonic_ns` at the press
Way = Callable[[PageDriver, str, Path], AbstractContextManager[Press]]  # of a team, in a folder
_READY_S: Final = 30.0  # for a program to listen to its keys
_SHOWN: Final = "STOP"  # what it says of its keys or buttons, once it listens to them
_ARMED: Final = "armed: Enter stops"  # what an emergency stop says once all would hear it
# Keys come from a terminal that is the program's own, not merely its standard input.
_IN_TERMINAL: Final = (
    "import fcntl, os, sys, termios; os.setsid(); fcntl.ioctl(0, termios.TIOCSCTTY, 0); "
    "os.execv(sys.argv[1], sys.argv[1:])"
)
_BUTTON: Final = 0x01  # kind of an event of linux/joystick.h


@contextmanager
def by_page(page: PageDriver, _team: str, _folder: Path) -> Iterator[Press]:
    """The page's button, from the page that drives."""
    yield page.press_stop


@contextmanager
def by_silence(page: PageDriver, _team: str, _folder: Path) -> Iterator[Press]:
    """The page that drives says nothing any more."""
    yield page.fall_silent


@contextmanager
def by_estop(_page: PageDriver, _team: str, folder: Path) -> Iterator[Press]:
    """`quadriga estop`, from the start of its process."""
    running: list[subprocess.Popen[bytes]] = []
    with (folder / "estop.log").open("ab") as log:

        def press() -> int:
            at = monotonic_ns()
            command = (*QUADRIGA, "estop", "--reason", "bench")
            running.append(subprocess.Popen(command, stdout=log, stderr=log))
            return at

        try:
            yield press
        finally:
            for process in running:
                end_process(process)


@contextmanager
def by_armed_estop(_page: PageDriver, _team: str, folder: Path) -> Iterator[Press]:
    """The Enter key of `quadriga estop --armed`, which ends with the stop; so each has its own."""
    running: list[subprocess.Popen[bytes]] = []

    def press() -> int:
        path = folder / f"armed-{len(running)}.log"
        words = ("--reason", "bench", "--armed", "--config", str(folder / CONFIG))
        with path.open("wb") as log:
            running.append(
                process := subprocess.Popen(
                    (*QUADRIGA, "estop", *words), stdin=subprocess.PIPE, stdout=log, stderr=log
                )
            )
        _await_words("quadriga estop", process, path, _ARMED)
        assert process.stdin is not None  # it is a pipe
        with process.stdin:
            return _write(process.stdin.fileno(), b"\n")

    try:
        yield press
    finally:
        for process in running:
            end_process(process)


@contextmanager
def by_keyboard(_page: PageDriver, team: str, folder: Path) -> Iterator[Press]:
    """The key of `quadriga drive --keyboard`, in a terminal of its own."""
    terminal, inside = pty.openpty()
    try:
        with _driving(("--keyboard",), team, folder / "keyboard.log", inside):
            yield lambda: _write(terminal, b"k")
    finally:
        os.close(terminal)
        os.close(inside)


@contextmanager
def by_gamepad(_page: PageDriver, team: str, folder: Path) -> Iterator[Press]:
    """The button of `quadriga drive --gamepad`, of a pad that is a pipe."""
    pad = folder / "gamepad"
    os.mkfifo(pad)
    pipe = os.open(pad, os.O_RDWR)
    down, up = (struct.pack("<IhBB", 0, value, _BUTTON, STOP_BUTTON) for value in (1, 0))
    try:
        with _driving(("--gamepad", str(pad)), team, folder / "gamepad.log"):
            yield lambda: _write(pipe, down + up)
    finally:
        os.close(pipe)
        pad.unlink()


WAYS: Final[Mapping[str, Way]] = MappingProxyType(
    {
        "page": by_page,
        "keyboard": by_keyboard,
        "estop": by_estop,
        "armed": by_armed_estop,
        "gamepad": by_gamepad,
        "silence": by_silence,
    }
)
STANDS: Final = frozenset(("silence",))  # after which robots stand, instead of being damped


def _write(descriptor: int, payload: bytes) -> int:
    at = monotonic_ns()
    os.write(descriptor, payload)
    return at


@contextmanager
def _driving(
    options: tuple[str, ...], team: str, path: Path, terminal: int | None = None
) -> Iterator[None]:
    """`quadriga drive` within the block, once it has shown what it listens to."""
    command = (*QUADRIGA, "drive", *options, "--set", f"team.name={team}")
    if terminal is not None:
        command = (*PYTHON, "-c", _IN_TERMINAL, *command)
    with path.open("wb") as log:
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL if terminal is None else terminal,
            stdout=log,
            stderr=log,
        )
    try:
        _await_words("quadriga drive", process, path, _SHOWN)
        yield
    finally:
        end_process(process)


def _await_words(name: str, process: subprocess.Popen[bytes], path: Path, words: str) -> None:
    """Wait until a program has said something, which is in a file."""
    deadline = monotonic() + _READY_S
    while words not in path.read_text(encoding="utf-8", errors="replace"):
        if process.poll() is not None or monotonic() > deadline:
            said = path.read_text(encoding="utf-8", errors="replace").strip()
            raise ProcessError(name, said[-200:] or "nothing said", f"to say {words!r}")
        sleep(0.05)
