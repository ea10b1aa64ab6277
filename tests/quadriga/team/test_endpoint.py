"""Every team finds a place of its own."""

from __future__ import annotations

import errno
import secrets
import socket
from contextlib import nullcontext
from dataclasses import replace

import pytest

from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.config.sections import BusConfig, Config
from quadriga.shared.errors import ConfigError
from quadriga.team.endpoint import endpoint_claimed, free_endpoint, with_free_endpoint

WAIT = 10.0  # s


def test_a_team_meets_at_an_address_of_its_own() -> None:
    first, second = free_endpoint(), free_endpoint()
    assert first.rpartition(":")[0] != second.rpartition(":")[0]
    config = BusConfig(endpoint=first)
    with Bus.open(config, "team", "sim") as sim, Bus.open(config, "team", "r1") as r1:
        r1.declare(HERE)
        assert sim.wait_for(HERE, {"r1"}, WAIT, lambda: False)


def test_where_the_address_cannot_be_had_a_port_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(secrets, "token_bytes", lambda count: bytes([7] * count))
    with socket.socket() as other:
        other.bind(("127.7.7.2", 7447))
        assert free_endpoint().startswith("tcp/127.0.0.1:")
    assert free_endpoint() == "tcp/127.7.7.2:7447"


def test_without_ipv4_all_processes_take_the_loopback_of_ipv6(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    bind = socket.socket.bind

    def without_ipv4(self: socket.socket, address: tuple[str, int]) -> None:
        if self.family == socket.AF_INET:
            raise OSError(errno.EADDRNOTAVAIL, "Cannot assign requested address")
        bind(self, address)

    monkeypatch.setattr(socket.socket, "bind", without_ipv4)
    try:
        free_endpoint()
    except OSError:
        pytest.skip("this computer has no IPv6")
    bus = with_free_endpoint(Config(), {}).bus
    assert bus.endpoint.startswith("tcp/[::1]:")
    with Bus.open(bus, "team", "sim") as sim, Bus.open(bus, "team", "r1") as r1:
        r1.declare(HERE)
        assert sim.wait_for(HERE, {"r1"}, WAIT, lambda: False)


def test_no_team_walks_where_another_one_does() -> None:
    config = Config(bus=BusConfig(endpoint=free_endpoint()))
    given = {"bus": {"endpoint": config.bus.endpoint}}
    assert with_free_endpoint(config, given) == config
    with Bus.open(config.bus, "team", "sim"):
        with pytest.raises(ConfigError, match="where something listens, expected an endpoint of"):
            with_free_endpoint(config, given)
        assert with_free_endpoint(config, {}).bus.endpoint != config.bus.endpoint


@pytest.mark.parametrize("mode", ["peer", "client"])
def test_of_two_walks_of_one_name_at_one_endpoint_the_second_is_refused(mode: str) -> None:
    config = Config(bus=BusConfig(mode=mode, endpoint=free_endpoint()))
    other = replace(config, team=replace(config.team, name="other"))
    refused = pytest.raises(ConfigError, match="where another walk begins")
    with endpoint_claimed(config):
        with refused, endpoint_claimed(config):
            pass
        with nullcontext() if mode == "client" else refused, endpoint_claimed(other):
            pass  # teams of two names have one router
    with endpoint_claimed(config):
        pass
