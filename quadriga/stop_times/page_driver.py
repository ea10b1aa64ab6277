"""SHELL of somebody who drives from the page: says what its script says, over the same sockets."""

from __future__ import annotations

import json
from contextlib import suppress
from threading import Event, Lock, Thread
from typing import Any, Final, Self
from urllib.parse import urlsplit

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from quadriga.drive.driver_words import DRIVE, GO_ON, NEWS, RESET, TAKE
from quadriga.drive.driver_words import ESTOP as STOP_AT_ONCE
from quadriga.drive.wish import NAMES, Wish
from quadriga.shared.errors import ProcessError
from quadriga.shared.modes import ESTOP, PASSIVE, STAND, WALK
from quadriga.shared.runtime.clock import monotonic, monotonic_ns

_PERIOD: Final = 0.05  # s, between two of what the page asks for
_AGAIN: Final = 0.5  # s, between two times that a word is said which does not come true
_FRESH: Final = 0.25  # s, twice the time between two news and a half more
_PATIENCE: Final = 60.0  # s, for a team to walk again; it gets up and stands first
_BY: Final = "bench"


class PageDriver:
    """Drives a team until it is closed; a context.

    Args:
        url: of the page, with its token.
        wish: what is asked for.

    Raises:
        OSError: nobody listens there.
    """

    def __init__(self, url: str, wish: Wish) -> None:
        self._wish = wish
        parts = urlsplit(url)
        self._drive, self._stop = (
            connect(f"ws://{parts.netloc}/{name}?{parts.query}", compression=None)
            for name in ("drive", "stop")
        )
        self._news: dict[str, Any] = {}
        self._told = 0.0
        self._lock, self._over, self._spoke_ns = Lock(), Event(), 0
        self._silent = False
        self._threads = [
            Thread(target=self._ask, daemon=True),
            Thread(target=self._listen, args=(self._drive,), daemon=True),
            Thread(target=self._listen, args=(self._stop,), daemon=True),
        ]
        for thread in self._threads:
            thread.start()

    def walk(self) -> None:
        """Take the controls, and have all robots walk, whatever they have stopped for.

        Raises:
            ProcessError: they do not within 60 s.
        """
        with self._lock:
            self._silent = False
        deadline = monotonic() + _PATIENCE
        while not self.drives():
            if monotonic() > deadline:
                got = ", ".join(
                    f"{n}: {r['mode']} {r['reason']}" for n, r in self._robots().items()
                )
                raise ProcessError("the team", got or "no news", f"to walk in {_PATIENCE:g} s")
            news = self._news
            if news and news["driver"] != news["you"]:
                self._say(self._drive, TAKE)
            elif any(robot["mode"] in (ESTOP, PASSIVE) for robot in self._robots().values()):
                self._say(self._drive, RESET, text=_BY)
            elif self.are_all(STAND, WALK):
                self._say(self._drive, GO_ON)
            self._over.wait(_AGAIN)

    def drives(self) -> bool:
        """Whether all robots walk and it is in charge, as it was told just now."""
        news = self._news
        in_charge = bool(news) and news["driver"] == news["you"] and not news["stands"]
        return in_charge and monotonic() - self._told < _FRESH and self.are_all(WALK)

    def press_stop(self) -> int:
        """Press the page's stop button; `monotonic_ns` at the press."""
        at = monotonic_ns()
        self._say(self._stop, STOP_AT_ONCE, text="page")
        return at

    def fall_silent(self) -> int:
        """Ask for nothing any more, as a page that hangs; `monotonic_ns` of what was said last."""
        with self._lock:
            self._silent = True
            return self._spoke_ns

    def are_all(self, *modes: str) -> bool:
        """Whether all robots were in one of these modes when the page was told last."""
        robots = self._robots()
        return bool(robots) and all(robot["mode"] in modes for robot in robots.values())

    def _robots(self) -> dict[str, Any]:
        robots: dict[str, Any] = self._news.get("robots", {})
        return robots

    def _ask(self) -> None:
        asked = {name: getattr(self._wish, name) for name in NAMES}
        with suppress(ConnectionClosed):
            while not self._over.wait(_PERIOD):
                with self._lock:
                    if not self._silent:
                        self._spoke_ns = monotonic_ns()
                        self._say(self._drive, DRIVE, held=True, **asked)

    def _listen(self, link: ClientConnection) -> None:
        with suppress(ConnectionClosed):
            for text in link:
                told = json.loads(text)
                if told["kind"] == NEWS:
                    self._told, self._news = monotonic(), told

    def _say(self, link: ClientConnection, kind: str, **fields: Any) -> None:
        link.send(json.dumps({"kind": kind, **fields}))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        for link in (self._drive, self._stop):
            link.close()
        for thread in self._threads:
            thread.join()
