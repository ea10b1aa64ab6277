"""Off the loopback there are certificates, or somebody has said that there need be none."""

from __future__ import annotations

import pytest

from quadriga.shared.config.endpoints import check_exposure, host_and_port, is_loopback
from quadriga.shared.config.sections import BusConfig
from quadriga.shared.errors import ConfigError

HERE = ("tcp/127.0.0.1:7447", "tcp/127.9.8.7:0", "tcp/localhost:1", "tcp/[::1]:7447")
NO_ENDPOINT = ("", "tcp", "carrier-pigeon/roof:1")  # left to the bus
AWAY = (
    "tcp/0.0.0.0:7447",
    "udp/10.0.0.1:7447",
    "tcp/router:7447",
    "tcp/[fe80::1]:7447",
    "ws/10.0.0.1:80",
    "tcp/127.0.0.1.example.org:7447",
    "serial//dev/ttyUSB0",
    "tcp/10.0.0.1:7447#iface=lo",
)


@pytest.mark.parametrize("mode", ["peer", "client"])
def test_only_the_loopback_needs_neither_certificates_nor_a_second_word(mode: str) -> None:
    for endpoint in (*HERE, *NO_ENDPOINT):
        assert is_loopback(endpoint)
        check_exposure(BusConfig(mode=mode), "bus.endpoint", endpoint)
    for endpoint in AWAY:
        with pytest.raises(ConfigError) as caught:
            check_exposure(BusConfig(mode=mode), "bus.endpoint", endpoint)
        assert caught.value.name == "bus.endpoint"
        check_exposure(BusConfig(mode=mode, plaintext=True), "bus.endpoint", endpoint)


def test_certificates_are_for_clients_of_a_router() -> None:
    check_exposure(BusConfig(mode="client"), "bus.endpoint", "tls/10.0.0.1:7447")
    with pytest.raises(ConfigError, match=r"bus\.mode: got 'peer' with tls/10.0.0.1:7447"):
        check_exposure(BusConfig(), "bus.endpoint", "tls/10.0.0.1:7447")


@pytest.mark.parametrize(
    "endpoint", ["tls/", "tls/host", "tls/host:x", "tls/host:70000", "tls/:7447", "tls/a:1#b=c"]
)
def test_an_endpoint_with_certificates_is_a_host_and_a_port(endpoint: str) -> None:
    assert host_and_port("tls/[::1]:7447") == ("::1", 7447)
    assert host_and_port("tls/router.lab:1") == ("router.lab", 1)
    with pytest.raises(ConfigError, match="tls/HOST:PORT"):
        check_exposure(BusConfig(mode="client"), "bus.endpoint", endpoint)
