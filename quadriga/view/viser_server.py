"""SHELL: the web server of a view, on this machine alone unless somebody says otherwise."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout

import viser

from quadriga.view.port import PageAddress, check_port, taken_error


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
        with redirect_stdout(nowhere):
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
