"""Nobody can have a process of the team unpack what they have packed."""

from __future__ import annotations

import json
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import zenoh

from quadriga.shared.bus.session import Bus
from quadriga.shared.config.sections import BusConfig
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.team.endpoint import free_endpoint

PAYLOAD = bytes(50_000)  # zeros: packed, some hundred bytes
WAIT = 10.0  # s, far more than it takes


class Wire:
    """A port that passes on to another one what comes, and counts it."""

    def __init__(self, to: tuple[str, int]) -> None:
        self._server = socket.create_server(("127.0.0.1", 0))
        self._to, self.passed = to, 0
        self.endpoint = f"tcp/127.0.0.1:{self._server.getsockname()[1]}"
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                near, far = self._server.accept()[0], socket.create_connection(self._to)
                for pair in ((near, far), (far, near)):
                    threading.Thread(target=self._pass, args=pair, daemon=True).start()

    def _pass(self, source: socket.socket, sink: socket.socket) -> None:
        with suppress(OSError):
            while content := source.recv(1 << 16):
                self.passed += len(content)
                sink.sendall(content)

    def close(self) -> None:
        self._server.close()


@contextmanager
def packing(**endpoints: str) -> Iterator[zenoh.Session]:
    """A stranger's session that offers to pack what it sends."""
    settings = {f"{way}/endpoints": [endpoint] for way, endpoint in endpoints.items()}
    config = zenoh.Config()
    for key, value in {
        "scouting/multicast/enabled": False,
        "transport/unicast/compression/enabled": True,
        **settings,
    }.items():
        config.insert_json5(key, json.dumps(value))
    with zenoh.open(config) as session:
        yield session


def sent_through(endpoint: str, heard: list[bytes]) -> int:
    """Bytes on the wire from a stranger that packs until somebody there has heard all of it."""
    host, port = endpoint.removeprefix("tcp/").split(":")
    wire = Wire((host, int(port)))
    try:
        with packing(connect=wire.endpoint) as stranger:
            deadline = monotonic() + WAIT
            while not heard and monotonic() < deadline:
                stranger.put("team/r1/status", PAYLOAD)
                sleep(0.05)
            assert heard[:1] == [PAYLOAD]
            return wire.passed // len(heard)
    finally:
        wire.close()


def test_a_process_of_the_team_takes_nothing_that_is_packed() -> None:
    endpoint, heard = free_endpoint(), list[bytes]()
    with Bus.open(BusConfig(endpoint=endpoint), "team", "sim") as bus:
        bus.hear("team/r1/status", heard.append)
        assert sent_through(endpoint, heard) >= len(PAYLOAD)


def test_two_that_both_pack_would() -> None:
    """So that the test before this one can fail."""
    endpoint, heard = free_endpoint(), list[bytes]()
    with packing(listen=endpoint) as other:
        other.declare_subscriber("team/**", lambda sample: heard.append(sample.payload.to_bytes()))
        assert sent_through(endpoint, heard) < len(PAYLOAD) // 10


def test_nor_does_a_router() -> None:
    endpoint, heard = free_endpoint(), list[bytes]()
    client = BusConfig(endpoint=endpoint, mode="client")
    with Bus.route(endpoint, "team"), Bus.open(client, "team", "r2") as bus:
        bus.hear("team/r1/status", heard.append)
        assert sent_through(endpoint, heard) >= len(PAYLOAD)
