"""Whose page a browser's request is of."""

from __future__ import annotations

import pytest
from websockets.datastructures import Headers

from quadriga.shared.security.own_page import LOOPBACK, is_of_own_page


@pytest.mark.parametrize(
    ("host", "origin", "is_own"),
    [
        ("127.0.0.1:8090", "http://127.0.0.1:8090", True),
        ("localhost:8090", "http://localhost:8090", True),
        ("localhost:9000", "http://localhost:9000", True),  # forwarded
        ("127.0.0.1:8090", None, True),  # opened by its address, or no browser
        ("127.0.0.1:8090", "http://localhost:8090", False),
        ("127.0.0.1:8090", "http://127.0.0.1:8091", False),  # another program's page
        ("127.0.0.1:8090", "https://127.0.0.1:8090", False),
        ("127.0.0.1:8090", "http://evil.example", False),
        ("127.0.0.1:8090", "null", False),  # a page in a sandbox
        ("evil.example:8090", "http://evil.example:8090", False),  # its name leads here
        ("127.0.0.1.evil.example", None, False),
        ("127.0.0.1@evil.example", None, False),
        ("", None, False),
    ],
)
def test_a_page_on_the_loopback_serves_itself_alone(
    host: str, origin: str | None, is_own: bool
) -> None:
    headers = Headers(Host=host) if origin is None else Headers(Host=host, Origin=origin)
    assert is_of_own_page(headers, LOOPBACK) is is_own


def test_a_page_that_others_reach_has_any_name_but_serves_itself_alone() -> None:
    assert is_of_own_page(Headers(Host="lab:8090", Origin="http://lab:8090"))
    assert not is_of_own_page(Headers(Host="lab:8090", Origin="http://evil.example"))


def test_a_request_that_says_it_twice_or_not_is_refused() -> None:
    twice = Headers([("Host", "127.0.0.1"), ("Host", "evil.example")])
    assert not is_of_own_page(twice, LOOPBACK)
    assert not is_of_own_page(Headers(), LOOPBACK)
    two = Headers([("Host", "a"), ("Origin", "http://a"), ("Origin", "http://b")])
    assert not is_of_own_page(two)
