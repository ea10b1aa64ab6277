"""Single keys from the terminal, if there is one."""

from __future__ import annotations

import os
import select
import sys
import termios
import tty
from collections.abc import Mapping
from typing import Any, Self

from quadriga.shared.runtime.clock import sleep


class Keyboard:
    """Some keys, without echo or return key while the context lasts.

    Without a terminal on stdin, or in the background, no key ever comes.

    Args:
        keys: the meaning of each, by the bytes that it sends; a longer one before its beginning.

    Attributes:
        listens: whether keys can come.
    """

    def __init__(self, keys: Mapping[bytes, str]) -> None:
        self._keys = keys
        self._before: list[Any] = []
        self._unread = b""
        self.listens = False

    def get(self, timeout: float) -> str:
        """The next key by its meaning, or "" if none comes within `timeout` seconds."""
        if not self._unread:
            if not self.listens:
                sleep(timeout)
                return ""
            if not select.select([self._stdin], [], [], max(timeout, 0.0))[0]:
                return ""
            self._unread = self._read()
        for key, meaning in self._keys.items():
            if self._unread.startswith(key):
                self._unread = self._unread[len(key) :]
                return meaning
        self._unread = self._unread[1:]
        return ""

    def _read(self) -> bytes:
        try:
            keys = os.read(self._stdin, 64)
        except OSError:  # how a terminal that was closed answers
            keys = b""
        self.listens = bool(keys)
        return keys

    def __enter__(self) -> Self:
        if sys.stdin is None:  # started with it closed
            return self
        try:
            self._stdin = sys.stdin.fileno()
            if os.tcgetpgrp(self._stdin) != os.getpgrp():
                return self  # of another process: changing it would stop this one
            self._before = termios.tcgetattr(self._stdin)
        except (OSError, ValueError, termios.error):
            return self
        tty.setcbreak(self._stdin)
        self.listens = True
        return self

    def __exit__(self, *_: object) -> None:
        if self._before:
            try:
                termios.tcsetattr(self._stdin, termios.TCSADRAIN, self._before)
            except termios.error:
                return  # the terminal is gone
