"""SHELL of the page from which a team is driven.

It is served on the loopback alone, to whoever has its token; a page of another origin cannot reach
it. Stops have a connection of their own, behind nothing else.
"""

from __future__ import annotations

import hmac
import secrets
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from importlib.resources import files
from types import MappingProxyType
from typing import Final
from urllib.parse import parse_qs, urlsplit

from websockets.asyncio.server import ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from quadriga.drive.attend import Attendant
from quadriga.drive.driver_words import MOST_BYTES
from quadriga.shared.security.own_page import LOOPBACK, UNHEARD, is_of_own_page

HOST: Final = "127.0.0.1"
_PAGES: Final = MappingProxyType(
    {
        "/": ("drive.html", "text/html; charset=utf-8"),
        "/drive.js": ("drive.js", "text/javascript; charset=utf-8"),
        "/drive.css": ("drive.css", "text/css; charset=utf-8"),
    }
)
_DRIVE, _STOP = "/drive", "/stop"
_FINE, _FORBIDDEN, _UNKNOWN = 200, 403, 404


@asynccontextmanager
async def serve_page(attendant: Attendant, port: int, view: str) -> AsyncIterator[str]:
    """Serve the page within the block; its URL with its token.

    Args:
        attendant: attends to those who drive from it.
        port: on the loopback; 0: any that is free.
        view: URL of the picture that it frames; "" if there is none.

    Raises:
        OSError: the port cannot be used.
    """
    page = _Page(attendant, view)
    async with serve(
        page.attend,
        HOST,
        port,
        process_request=page.answer,
        max_size=MOST_BYTES,
        max_queue=16,
        compression=None,
        ping_interval=None,
        logger=UNHEARD,
    ) as server:
        page.port = next(iter(server.sockets)).getsockname()[1]
        yield f"http://{HOST}:{page.port}/?token={page.token}"


class _Page:
    def __init__(self, attendant: Attendant, view: str) -> None:
        self._attendant, self._view = attendant, view
        self.port = 0
        self.token = secrets.token_urlsafe(16)

    async def attend(self, connection: ServerConnection) -> None:
        """Attend to one connection until it is closed."""
        request = connection.request
        drives = request is not None and urlsplit(request.path).path == _DRIVE
        with suppress(ConnectionClosed):
            kind = "page" if drives else "stop button of page"
            await self._attendant.attend(kind, connection, connection.send, news=drives)

    def answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """Give the page's files, refuse foreigners, and let connections be opened (None)."""
        if not is_of_own_page(request.headers, LOOPBACK):
            return connection.respond(_FORBIDDEN, "only for this computer's own page\n")
        parts = urlsplit(request.path)
        if parts.path in ("/", _DRIVE, _STOP):
            token = parse_qs(parts.query).get("token", [""])[0]
            if not hmac.compare_digest(token.encode(), self.token.encode()):
                return connection.respond(_FORBIDDEN, "the token is missing or an old one\n")
        if parts.path in (_DRIVE, _STOP):
            return None
        if parts.path not in _PAGES:
            return connection.respond(_UNKNOWN, "no such page\n")
        name, kind = _PAGES[parts.path]
        text = files("quadriga.drive").joinpath("page", name).read_text(encoding="utf-8")
        return _respond(text.replace("{{view}}", self._view).encode(), kind)


def _respond(body: bytes, kind: str) -> Response:
    headers = Headers(
        {
            "Content-Type": kind,
            "Content-Length": str(len(body)),
            "Cache-Control": "no-store",
            "X-Frame-Options": "DENY",
            "Connection": "close",
        }
    )
    return Response(_FINE, "OK", headers, body)
