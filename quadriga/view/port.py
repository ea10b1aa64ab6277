"""Where on this machine a view is found."""

from __future__ import annotations

import os
import socket
import sys
from typing import Final

from quadriga.shared.errors import ConfigError, system_reason
from quadriga.shared.runtime.record import record

HOST: Final = "127.0.0.1"
PORT: Final = 8090


@record
class PageAddress:
    """Where a view's page is served.

    Attributes:
        port: 0: any that is free.
        host: an address of this computer; the loopback is reached by nobody else.
    """

    port: int
    host: str = HOST


def check_port(port: int, option: str = "--port", host: str = HOST) -> int:
    """The port, if a server can listen on it now; 0 stands for any that is free.

    Raises:
        ConfigError: it is in use, not permitted, or none, or this computer has no such address.
    """
    with socket.socket() as probe:
        # A server that has just ended leaves its port in a state in which this permits it.
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except socket.gaierror as error:
            got = f"{host!r} ({error.strerror})"
            raise ConfigError("--host", got, "an address of this computer") from None
        except (OSError, OverflowError) as error:
            reason = system_reason(error) if isinstance(error, OSError) else str(error)
            raise taken_error(port, reason, option) from None
        found: int = probe.getsockname()[1]
        return found


def free_port() -> int:
    """The usual port, or another one if that is in use."""
    try:
        return check_port(PORT)
    except ConfigError:
        return check_port(0)


def choose_port(asked: int | None, *, wanted: bool) -> int | None:
    """Where a walk is shown; None: nowhere.

    Args:
        asked: the port that was asked for; 0: any; None: none was.
        wanted: whether it is shown then all the same.

    Raises:
        ConfigError: the port that was asked for cannot be had.
    """
    if asked:
        return check_port(asked, "--view")
    return free_port() if wanted or asked is not None else None


def is_at_display() -> bool:
    """Whether somebody sits there: standard output is a terminal, of a computer with a display."""
    shown = any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))
    return shown and sys.stdout.isatty()


def taken_error(port: int, reason: str, option: str = "--port") -> ConfigError:
    """What is said of a port that cannot be had."""
    return ConfigError(
        option, f"{port} ({reason})", "a port that is free", "is another view open there?"
    )


def url_of(port: int, host: str = HOST) -> str:
    """What to open in a browser."""
    return f"http://{host}:{port}"
