"""SHELL: the web server of a view, on this machine alone unless somebody says otherwise."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator
from contextlib import contextmanager, redirect_stdout
from typing import Any, Final

import viser
import websockets.asyncio.server
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from quadriga.shared.security.own_page import FRAMED_BY, LOOPBACK, UNHEARD, is_of_own_page
from quadriga.view.port import HOST, PageAddress, check_port, taken_error

_FORBIDDEN: Final = 403


class LocalServer(viser.ViserServer):
    """Viser's server, without its way to share a page with the world."""

    def request_share_url(self, verbose: bool = True) -> None:
        """Refuse: any page that reaches the server may ask for a public address."""


@contextmanager
def open_server(address: PageAddress, title: str) -> Iterator[LocalServer]:
    """A web server while the context lasts.

    Args:
        address: where.
        title: what the panel is called.

    Raises:
        ConfigError: the port is in use, or not permitted.
    """
    host, port = address.host, address.port
    check_port(port, host=host)
    # What it prints about itself would stand between the lines of this project.
    with open(os.devnull, "w", encoding="utf-8") as nowhere:
        names = LOOPBACK if host == HOST else ()
        with redirect_stdout(nowhere), _refusing_foreigners(names):
            server = LocalServer(host=host, port=port, label=title, verbose=False)
        try:
            if port and server.get_port() != port:  # it takes the next one that is free
                raise taken_error(port, "taken a moment ago")
            server.gui.configure_theme(
                control_width="large", show_logo=False, show_share_button=False
            )
            server.gui.main_panel.dock_right()
            yield server
        finally:
            with redirect_stdout(nowhere):
                server.stop()


@contextmanager
def _refusing_foreigners(names: Collection[str]) -> Iterator[None]:
    """Have the server that is made within the context refuse requests of other pages.

    Viser has no option for it, so what it serves with is replaced meanwhile.

    Args:
        names: of the computers at which the page is found; empty: any.

    Raises:
        RuntimeError: Viser serves in another way, so nobody would be refused.
    """
    module, has_served = websockets.asyncio.server, False
    usual = module.serve

    def serve(*args: Any, process_request: Any, **options: Any) -> websockets.asyncio.server.serve:
        nonlocal has_served
        has_served = True

        def answer(connection: ServerConnection, request: Request) -> Response | None:
            if not is_of_own_page(request.headers, names):
                return connection.respond(_FORBIDDEN, "only for this view's own page\n")
            answered: Response | None = process_request(connection, request)
            if answered is not None:
                answered.headers["Content-Security-Policy"] = FRAMED_BY
            return answered

        return usual(*args, process_request=answer, **options | {"logger": UNHEARD})

    module.serve = serve  # type: ignore[misc, assignment]
    try:
        yield
    finally:
        module.serve = usual  # type: ignore[misc]
    if not has_served:
        raise RuntimeError("viser does not serve with websockets.asyncio.server.serve")
