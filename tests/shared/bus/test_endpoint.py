"""Why an endpoint cannot be reached, told apart by real sockets."""

from __future__ import annotations

import socket

import pytest

from quadriga.shared.bus.endpoint import is_loopback, split_endpoint, try_endpoint


@pytest.mark.parametrize(
    ("endpoint", "parts"),
    [
        ("tcp/10.0.0.1:7447", ("tcp", "10.0.0.1", 7447)),
        ("tls/lab.example:1?x=1#iface=eth0", ("tls", "lab.example", 1)),
        ("tcp/[::1]:7447", ("tcp", "::1", 7447)),
        ("tcp/lab", None),
        ("pigeon", None),
        ("", None),
    ],
)
def test_the_parts_of_an_endpoint(endpoint: str, parts: tuple[str, str, int] | None) -> None:
    assert split_endpoint(endpoint) == parts


def test_somebody_listens_or_nobody_does() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        endpoint = f"tcp/127.0.0.1:{server.getsockname()[1]}"
        assert try_endpoint(endpoint).code == "open"
        assert try_endpoint(endpoint.replace("tcp", "tls")).code == "open"
    closed = try_endpoint(endpoint)
    assert (closed.code, closed.text) == ("refused", f"nobody listens at {endpoint}")


def test_a_computer_that_says_nothing() -> None:
    """Its backlog is full, so that it answers no more than one that is off."""
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        server.listen(0)
        where = server.getsockname()
        with socket.create_connection(where):
            reach = try_endpoint(f"tcp/127.0.0.1:{where[1]}", timeout=0.2)
    assert reach.code == "silent"
    assert "127.0.0.1 does not answer within 0.2 s: it is off" in reach.text


@pytest.mark.parametrize(
    ("endpoint", "code"),
    [
        ("tcp/no such host:1", "unresolved"),
        ("tcp/name.invalid:1", "unresolved"),
        ("udp/127.0.0.1:1", "untried"),
        ("pigeon/roof", "untried"),
        ("tcp/127.0.0.1:99999", "untried"),
    ],
)
def test_other_reasons(endpoint: str, code: str) -> None:
    assert try_endpoint(endpoint, timeout=0.2).code == code


@pytest.mark.parametrize(
    ("endpoint", "loopback"),
    [
        ("tcp/127.3.4.2:7447", True),
        ("tcp/localhost:1", True),
        ("tcp/[::1]:1", True),
        ("tcp/10.0.0.1:7447", False),
        ("tcp/router:7447", False),
        ("pigeon", False),
    ],
)
def test_a_loopback_endpoint_is_of_one_computer(endpoint: str, loopback: bool) -> None:
    assert is_loopback(endpoint) is loopback
