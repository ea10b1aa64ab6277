"""SHELL of lines that come in through a file descriptor, read without ever waiting."""

from __future__ import annotations

import os
import select
from typing import Final

_AT_ONCE: Final = 4096  # bytes of a look
_LONGEST: Final = 1000  # characters of a line


class Console:
    """Whole lines of a pipe, a terminal or a file, as they come; none after its end.

    A process in the background of a terminal is stopped when it reads from it: it does not look.

    Args:
        source: a file descriptor, such as that of the standard input.
    """

    def __init__(self, source: int) -> None:
        self._source: int | None = source
        self._rest = b""

    def lines(self) -> list[str]:
        """Lines that have come whole since the last call, without their ends."""
        if self._source is None:
            return []
        try:
            if not self._is_ready(self._source):
                return []
            got = os.read(self._source, _AT_ONCE)
        except (OSError, ValueError):  # it is closed, or was never open
            got = b""
        if not got:
            self._source = None
            got = b"\n" if self._rest else b""
        *whole, self._rest = (self._rest + got).split(b"\n")
        self._rest = self._rest[:_LONGEST]
        return [line[:_LONGEST].decode(errors="replace").strip() for line in whole if line.strip()]

    @staticmethod
    def _is_ready(source: int) -> bool:
        if not select.select([source], [], [], 0.0)[0]:
            return False
        return not os.isatty(source) or os.tcgetpgrp(source) == os.getpgrp()
