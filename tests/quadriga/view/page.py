"""A page of a view without a browser: it hears what is drawn, and clicks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Self

import msgspec
import viser
import zstandard
from viser import _messages
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

from quadriga.shared.runtime.clock import monotonic

WAIT = 60.0  # s, far more than anything takes on a busy machine
Sent = dict[str, Any]


class Page:
    """What a browser would do once it has loaded the page at a URL.

    Args:
        url: of the view.
        origin: whose page it says it is; "": it says nothing, as a program that is no browser.
    """

    def __init__(self, url: str, origin: str = "") -> None:
        protocol = Subprotocol(f"viser-v{viser.__version__}")
        address = url.replace("http", "ws", 1)
        self._socket = connect(
            address,
            origin=Origin(origin) if origin else None,
            subprotocols=[protocol],
            max_size=None,
            compression=None,
        )
        upright, ahead = (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 1.0)
        self._send(
            _messages.ViewerCameraMessage(
                upright, ahead, 1.0, 0.1, 100.0, 100, 100, look_at=ahead, up_direction=ahead
            )
        )
        self.messages: list[Sent] = []

    def _send(self, message: _messages.Message) -> None:
        self._socket.send(msgspec.msgpack.encode(message.as_serializable_dict()))

    def click(self, uuid: str) -> None:
        """Click a button."""
        self._send(_messages.GuiUpdateMessage(uuid, {"value": True}))

    def await_message(self, fits: Callable[[Sent], bool]) -> Sent:
        """The first message that fits, of those that have come or will."""
        deadline, seen = monotonic() + WAIT, 0
        while True:
            for message in self.messages[seen:]:
                if fits(message):
                    return message
            seen = len(self.messages)
            assert monotonic() < deadline, f"none of {seen} messages fits"
            self._receive(deadline - monotonic())

    def forget(self) -> None:
        """Look only at what comes from now on."""
        self.messages.clear()

    def _receive(self, timeout: float) -> None:
        data = self._socket.recv(timeout)
        assert isinstance(data, bytes)
        size = int.from_bytes(data[8:16], "little")
        plain = zstandard.ZstdDecompressor().decompress(data[16 : 16 + size])
        self.messages += msgspec.msgpack.decode(plain)["messages"]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()


def named(name: str, kind: str = "") -> Callable[[Sent], bool]:
    """Messages of a node of the scene, of a type that holds `kind`."""
    return lambda message: message.get("name") == name and kind in message["type"]


def labelled(label: str) -> Callable[[Sent], bool]:
    """The message that adds a control with this label."""
    return lambda message: message.get("props", {}).get("label") == label


def updates(uuid: str, **values: object) -> Callable[[Sent], bool]:
    """A message that changes a control so."""
    return lambda message: message.get("uuid") == uuid and message.get("updates") == values
