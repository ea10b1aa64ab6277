"""Why an endpoint cannot be reached, told apart by real sockets."""

from __future__ import annotations

import socket

import pytest

from quadriga.shared.bus.settings import try_endpoint


def test_somebody_listens_or_nobody_does() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        endpoint = f"tcp/127.0.0.1:{server.getsockname()[1]}"
        assert try_endpoint(endpoint).code == "open"
        assert try_endpoint(f"{endpoint.replace('tcp', 'tls')}#iface=lo").code == "open"
    assert try_endpoint(endpoint) == ("refused", f"nobody listens at {endpoint}")


def test_a_computer_that_says_nothing() -> None:
    """Its backlog is full, so that it answers no more than one that is off."""
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        server.listen(0)
        where = server.getsockname()
        with socket.create_connection(where):
            reach = try_endpoint(f"tcp/127.0.0.1:{where[1]}", timeout=0.2)
    assert reach.code == "unreachable"


@pytest.mark.parametrize(
    ("endpoint", "code"),
    [
        ("tcp/no such host:1", "unreachable"),
        ("tcp/name.invalid:1", "unreachable"),
        ("udp/127.0.0.1:1", "untried"),
        ("pigeon/roof", "untried"),
        ("tcp/127.0.0.1:99999", "untried"),
    ],
)
def test_other_reasons(endpoint: str, code: str) -> None:
    assert try_endpoint(endpoint, timeout=0.2).code == code
