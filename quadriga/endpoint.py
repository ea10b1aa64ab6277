"""A free place on this machine for a team of its own."""

from __future__ import annotations

import socket


def free_endpoint() -> str:
    """An endpoint on this machine that nobody listens on at the moment."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"
