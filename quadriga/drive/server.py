"""SHELL that hears drivers, by a thread of its own: from a page, and from programs of this machine.

Each driver has a connection of its own, and speaks the words of `quadriga.drive.driver_words`.
Programs of the same user write them, a line each, to a Unix socket.
"""

from __future__ import annotations

import asyncio
import sys
from collections.abc import AsyncIterator
from concurrent.futures import Future
from contextlib import AsyncExitStack, suppress
from pathlib import Path
from threading import Thread
from typing import Final, Self

from quadriga.drive.attend import Attendant
from quadriga.drive.controls import DriveControls
from quadriga.drive.driver_words import MOST_BYTES
from quadriga.shared.errors import BusError, system_reason

_PATIENCE: Final = 2.0  # s, for the thread to end


class DriveServer:
    """Hears drivers until it is closed; a context.

    Args:
        controls: what drivers say goes there.
        port: of the page on the loopback; 0: any that is free; None: no page.
        path: of the Unix socket; None: no socket.
        view: URL of the picture that the page frames; "" if there is none.

    Attributes:
        url: of the page with its token; "" without one.

    Raises:
        BusError: the port cannot be used.
    """

    def __init__(
        self, controls: DriveControls, port: int | None, path: Path | None = None, view: str = ""
    ) -> None:
        self._attendant, self._view, self._path = Attendant(controls), view, path
        self._loop: asyncio.AbstractEventLoop | None = None
        self._over: asyncio.Event | None = None
        begun = Future[str]()
        self._thread = Thread(target=self._run, args=(port, begun), daemon=True, name="drive")
        self._thread.start()
        self.url = begun.result()

    def _run(self, port: int | None, begun: Future[str]) -> None:
        try:
            asyncio.run(self._serve(port, begun))
        except OSError as error:
            got = f"port {port}: {system_reason(error)}"
            cause = "does another program use it? reference.page_port = 0 takes any that is free"
            begun.set_exception(BusError("page to drive from", got, "a port that is free", cause))
        except Exception as error:
            if begun.done():
                raise  # the thread tells it; drivers are heard no more, and the team stands
            begun.set_exception(error)

    async def _serve(self, port: int | None, begun: Future[str]) -> None:
        self._loop, self._over = asyncio.get_running_loop(), asyncio.Event()
        async with AsyncExitStack() as stack:
            if port is not None:
                # Imported here, for most operators have no page.
                from quadriga.drive.page_server import serve_page

                page = serve_page(self._attendant, port, self._view)
                self._attendant.url = await stack.enter_async_context(page)
            if self._path is not None:
                await self._listen(self._path, stack)
            begun.set_result(self._attendant.url)
            await self._over.wait()

    async def _listen(self, path: Path, stack: AsyncExitStack) -> None:
        """Listen on the Unix socket, which only its user can open, until `stack` is unwound.

        A team walks without it, too: then a stop goes over the bus.
        """
        try:
            path.unlink(missing_ok=True)
            server = await asyncio.start_unix_server(self._attend, path, limit=2 * MOST_BYTES)
        except OSError as error:
            reason = system_reason(error)
            print(f"no socket for programs of this machine, {path}: {reason}", file=sys.stderr)
            return
        stack.callback(path.unlink, missing_ok=True)
        stack.push_async_exit(server)
        path.chmod(0o600)

    async def _attend(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        async def send(text: str) -> None:
            writer.write(f"{text}\n".encode())
            await writer.drain()

        try:
            with suppress(ConnectionError, ValueError):  # a line that is too long
                await self._attendant.attend("program", _lines(reader), send)
        finally:
            writer.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._loop is not None and self._over is not None:
            with suppress(RuntimeError):  # the loop has ended by itself
                self._loop.call_soon_threadsafe(self._over.set)
        self._thread.join(_PATIENCE)


async def _lines(reader: asyncio.StreamReader) -> AsyncIterator[bytes]:
    while line := await reader.readline():
        yield line
