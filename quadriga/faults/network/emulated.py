"""SHELL: an emulated network as a context, and processes started in its places."""

from __future__ import annotations

import json
import os
import select
import subprocess
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Final, Self

from quadriga.faults.network.layout import NetworkLayout
from quadriga.faults.network.order import RadioOrder
from quadriga.shared.errors import ProcessError, system_reason
from quadriga.shared.runtime.installed import PYTHON
from quadriga.shared.runtime.process_use import read_use
from quadriga.team.launch import ProcessSpec

_MODULE: Final = "quadriga.faults.network.air"
_START: Final = 60.0  # s
_LEAVE: Final = 5.0  # s
_LONGEST: Final = 400  # characters of its last words


class EmulatedNetwork:
    """A network of this machine's processes; leaving the context takes it down.

    Args:
        layout: its places.
        seed: of all chance on the air.
        log: gets what the air says.

    Raises:
        ProcessError: the system does not permit it.
    """

    def __init__(self, layout: NetworkLayout, seed: int, log: Path) -> None:
        self.layout, self._log = layout, log
        command = [*PYTHON, "-m", _MODULE, str(layout.number), str(seed), str(os.getpid())]
        command += [*layout.robots, *(["--wired"] if layout.wired else [])]
        command += ["--rto-min-ms", str(layout.rto_min_ms)]
        log.parent.mkdir(parents=True, exist_ok=True)
        with log.open("wb") as words:
            self._air = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=words
            )
        try:
            self._files = self._await_places()
        except BaseException:
            self.close()
            raise

    def order(self, order: RadioOrder) -> None:
        """Have the radio of a place do something to packets.

        Raises:
            ProcessError: the air is gone.
        """
        if self._air.stdin is None:
            raise ValueError("a pipe is asked for above")
        try:
            self._air.stdin.write(f"{order.to_line()}\n".encode())
            self._air.stdin.flush()
        except OSError as error:
            raise self._error(system_reason(error)) from None

    @property
    def processor_s(self) -> float:
        """Time of a processor that the air has used so far, s."""
        use = read_use(self._air.pid)
        return 0.0 if use is None else use.cpu_s

    def enter(self, place: str) -> tuple[str, ...]:
        """What a command line must begin with to be run at a place."""
        if place not in self._files:
            return ()
        return ("nsenter", f"--net=/proc/{self._air.pid}/fd/{self._files[place]}", "--")

    def wrap(self, row: ProcessSpec) -> ProcessSpec:
        """The row of a process that is started at its place, and can be reached there."""
        place = self.layout.place_of(row.name)
        if place not in self._files:
            return row
        listen = f'bus.listen="{self.layout.endpoint(place, 0)}"'
        return replace(row, command=(*self.enter(place), *row.command, "--set", listen))

    def close(self) -> None:
        """Take it down: processes that are still at its places reach nobody any more."""
        if self._air.stdin is not None:
            with suppress(OSError):  # of a last order that nobody took
                self._air.stdin.close()
        try:
            self._air.wait(_LEAVE)
        except subprocess.TimeoutExpired:
            self._air.kill()
            self._air.wait()
        if self._air.stdout is not None:
            self._air.stdout.close()

    def _await_places(self) -> dict[str, int]:
        """The open files of the air at which the places are, but the machine's own."""
        out = self._air.stdout
        if out is None:
            raise ValueError("a pipe is asked for above")
        ready, _, _ = select.select([out], (), (), _START)
        line = out.readline() if ready else b""
        if not line:
            raise self._error(f"no word within {_START:g} s")
        places: dict[str, int] = json.loads(line)
        return places

    def _error(self, got: str) -> ProcessError:
        words = self._log.read_text(encoding="utf-8", errors="replace").strip()
        return ProcessError("the emulated network", words[-_LONGEST:] or got, "places on the air")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
