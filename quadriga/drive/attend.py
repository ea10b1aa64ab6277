"""One driver's connection, whatever it comes over: what it says is done, and answered."""

from __future__ import annotations

import asyncio
import json
from collections import Counter
from collections.abc import AsyncIterable, Awaitable, Callable
from typing import Final

from quadriga.drive.client import HEARD
from quadriga.drive.controls import DriveControls
from quadriga.drive.driver_words import ESTOP, NEWS, WHERE, DriverWord, read_driver_word
from quadriga.drive.tell import Stopping, tell_news
from quadriga.shared.errors import MessageError

_NEWS: Final = 0.1  # s, between two of what drivers are told
_LOOK: Final = 0.005  # s, between two looks at whether all have stopped
# s, between two words of one driver, and of all of them together: whatever drivers say meanwhile
# waits in their own connections, so that a stop, which has another, finds this thread free.
_BETWEEN, _BETWEEN_ALL = 0.005, 0.001

Send = Callable[[str], Awaitable[None]]


class Attendant:
    """Attends to drivers; all of them in one thread.

    Args:
        controls: what drivers say goes there.

    Attributes:
        url: of the page with its token; "" if there is none.
    """

    def __init__(self, controls: DriveControls) -> None:
        self._controls = controls
        self.url = ""
        self._counts: Counter[str] = Counter()
        self._due = 0.0  # when the next word of anybody is heard

    async def attend(
        self, kind: str, texts: AsyncIterable[str | bytes], send: Send, *, news: bool = False
    ) -> None:
        """Do what a driver says until it leaves.

        Args:
            kind: of driver; with a number behind it, it is the driver's name.
            texts: what it says.
            send: sends it a text.
            news: whether it is told the news all the time; else when it asks for them.
        """
        self._counts[kind] += 1
        driver = f"{kind} {self._counts[kind]}"
        telling = asyncio.ensure_future(self._tell(driver, send)) if news else None
        try:
            async for text in texts:
                try:
                    said = read_driver_word(text)
                except MessageError as error:
                    await send(json.dumps({"kind": "error", "text": str(error)}))
                else:
                    self._controls.hear(driver, said)
                    await self._answer(driver, said, send)
                await self._pause()
        finally:
            self._controls.leave(driver)
            if telling is not None:
                telling.cancel()

    async def _pause(self) -> None:
        """Wait until it is a driver's turn to say another word."""
        now = asyncio.get_running_loop().time()
        self._due = max(self._due, now) + _BETWEEN_ALL
        await asyncio.sleep(max(_BETWEEN, self._due - now))

    async def _answer(self, driver: str, said: DriverWord, send: Send) -> None:
        if said.kind == NEWS:
            await send(tell_news(driver, self._controls))
        elif said.kind == WHERE:
            await send(json.dumps({"kind": WHERE, "url": self.url}))
        elif said.kind == ESTOP:  # at once, and once all have stopped or it has taken too long
            await send(json.dumps({"kind": HEARD, "number": said.number}))
            stopping = Stopping(self._controls)
            while not stopping.is_over():
                await asyncio.sleep(_LOOK)
            await send(stopping.tell(said.number))

    async def _tell(self, driver: str, send: Send) -> None:
        while True:
            await send(tell_news(driver, self._controls))
            await asyncio.sleep(_NEWS)
