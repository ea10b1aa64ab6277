"""Zenoh's log in the hands of this process: it can be had from its standard output alone."""

from __future__ import annotations

import fcntl
import os
import sys
import threading
from collections.abc import Callable, Sequence
from typing import Final

from quadriga.shared.bus.zenoh_bus import start_log
from quadriga.shared.runtime.clock import sleep

_PIPE: Final = 1 << 20  # bytes that Zenoh may write while nobody reads; then its threads wait
_MOST: Final = 1 << 18  # bytes that are looked at once
# s, between two looks: Zenoh writes line by line, and to be woken by each line takes as much of a
# processor as to pass the messages on.
_BETWEEN: Final = 0.01
_CARRIED: Final = 1 << 14  # bytes before these in which the line may be that a marker refers to


class ZenohLog:
    """The lines of Zenoh's log in which a marker is, and those before them.

    What this process itself prints to its standard output gets into it: it must print nothing.
    Nothing but the markers is looked for in most of the log, which has a line for each message.
    """

    def __init__(
        self, levels: str, markers: Sequence[str], take: Callable[[list[str]], None]
    ) -> None:
        """Begin; `take` is called in a thread of its own with whole lines, each of them once.

        Args:
            levels: what is logged, as `RUST_LOG` says it.
            markers: texts of which one must be in what is looked at.
            take: is given the lines up to the last one so far.
        """
        self._markers = [marker.encode() for marker in markers]
        self._take = take
        reading, writing = os.pipe()
        fcntl.fcntl(writing, fcntl.F_SETPIPE_SZ, _PIPE)
        sys.stdout.flush()
        os.dup2(writing, sys.stdout.fileno())
        os.close(writing)
        os.environ["RUST_LOG"] = levels  # what a user has there would hide refusals
        start_log()
        threading.Thread(target=self._read, args=(reading,), daemon=True).start()

    def _read(self, reading: int) -> None:
        kept = b""
        while chunk := os.read(reading, _MOST):
            kept += chunk
            end = kept.rfind(b"\n") + 1
            whole, rest = kept[:end], kept[end:]
            if any(marker in whole for marker in self._markers):
                self._take(whole.decode("utf-8", "replace").splitlines())
                kept = rest
            else:
                kept = kept[max(0, end - _CARRIED) :]
            if len(chunk) < _MOST:
                sleep(_BETWEEN)
