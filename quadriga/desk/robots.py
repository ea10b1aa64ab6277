"""SHELL of the simulated robots' process: started, told what to do, and listened to."""

from __future__ import annotations

import os
import re
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Final, NamedTuple, Self

from quadriga.shared.errors import ProcessError
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.runtime.installed import PYTHON

_STARTED: Final = "on the network"
_START: Final = 60.0  # s
_LEAVE: Final = 10.0  # s
_LOOK: Final = 0.02  # s
_LINE: Final = re.compile(r"(\d+) ms: (.*)")
_LAST_WORDS: Final = 12


class Said(NamedTuple):
    """A line of the simulated robots: their own time, ms, and what happened."""

    ms: int
    text: str


class SimulatedRobots:
    """Leaving the context switches them off.

    Args:
        config_file: of the team.
        kind: of robot.
        folder: gets their log and the truth on them.

    Raises:
        ProcessError: they did not come up.
    """

    def __init__(self, config_file: Path, kind: str, folder: Path) -> None:
        self._log, self.truth = folder / "robots.log", folder / "truth.csv"
        command = [*PYTHON, "-m", "quadriga", "sim", "--as", kind]
        command += ["--config", str(config_file), "--truth", str(self.truth)]
        command += ["--parent", str(os.getpid())]
        with self._log.open("wb") as log:
            self._process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=log, stderr=subprocess.STDOUT
            )
        try:
            self._await(lambda: _STARTED in self._read(), _START, "robots on the network")
        except BaseException:
            self._end()
            raise

    def order(self, line: str) -> int:
        """Tell the desk what happens to a robot; when it took that in, in its ms."""
        pipe, before = self._process.stdin, len(self.said())
        if pipe is None:
            raise ValueError("a pipe is asked for above")
        pipe.write(f"{line}\n".encode())
        pipe.flush()
        self._await(lambda: self._find(line, before) is not None, _LEAVE, f"an echo of {line!r}")
        found = self._find(line, before)
        return 0 if found is None else found.ms

    def _find(self, line: str, before: int) -> Said | None:
        return next((said for said in self.said()[before:] if line in said.text), None)

    def said(self) -> list[Said]:
        """What they have said so far."""
        matches = map(_LINE.fullmatch, self._read().splitlines())
        return [Said(int(m[1]), m[2]) for m in matches if m is not None]

    def wait_until(self, happens: Callable[[], bool], seconds: float) -> bool:
        """Wait; whether it happened."""
        deadline = monotonic() + seconds
        while not happens():
            if monotonic() > deadline or self._process.poll() is not None:
                return False
            sleep(_LOOK)
        return True

    def _await(self, happens: Callable[[], bool], seconds: float, what: str) -> None:
        if not self.wait_until(happens, seconds):
            words = "\n".join(f"  {line}" for line in self._read().splitlines()[-_LAST_WORDS:])
            raise ProcessError("the simulated robots", words or "nothing", what)

    def _read(self) -> str:
        return self._log.read_text(encoding="utf-8", errors="replace")

    def _end(self) -> None:
        if self._process.stdin is not None:
            self._process.stdin.close()
        self._process.terminate()
        try:
            self._process.wait(_LEAVE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._end()
