"""SHELL of a page that shows the team and draws nothing: the view's process works as for any."""

from __future__ import annotations

from contextlib import suppress
from threading import Thread
from typing import Any, Final, Self

import msgpack
import viser
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from quadriga.shared.errors import ProcessError
from quadriga.shared.runtime.clock import monotonic, sleep

_PATIENCE_S: Final = 30.0  # for the view to open its page
_LARGEST: Final = 64 << 20  # bytes of one message
# Without a camera a connection counts as none that looks.
_CAMERA: Final[dict[str, Any]] = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (3.0, 3.0, 2.0),
    "fov": 0.9,
    "near": 0.01,
    "far": 100.0,
    "image_height": 800,
    "image_width": 1280,
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
}


class ViewWatcher:
    """Takes in all that a view sends to its page until it is closed; a context.

    Args:
        port: of the view on the loopback.

    Attributes:
        received: bytes so far.

    Raises:
        ProcessError: no view listens there within 30 s.
    """

    def __init__(self, port: int) -> None:
        self.received = 0
        self._link = _open(port)
        self._link.send(msgpack.packb(_CAMERA))
        self._thread = Thread(target=self._take, daemon=True)
        self._thread.start()

    def _take(self) -> None:
        with suppress(ConnectionClosed):
            for message in self._link:
                self.received += len(message)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._link.close()
        self._thread.join()


def _open(port: int) -> ClientConnection:
    deadline = monotonic() + _PATIENCE_S
    while True:
        try:
            return connect(
                f"ws://127.0.0.1:{port}",
                subprotocols=[Subprotocol(f"viser-v{viser.__version__}")],
                compression=None,
                max_size=_LARGEST,
            )
        except OSError as error:
            if monotonic() > deadline:
                raise ProcessError("view", str(error), f"a page at port {port}") from None
            sleep(0.2)
