"""The Go2's services: requests and responses with text, over DDS.

A request has a number of its own; the response with this number answers it.
"""

from __future__ import annotations

import ctypes as c
from collections.abc import Iterator
from typing import Any, Final, NamedTuple

from quadriga.shared.unitree.dds import (
    DdsParticipant,
    StructReader,
    StructTopic,
    StructWriter,
    bytes_at,
    number_at,
    string_at,
)

MOTION_SWITCHER: Final = "motion_switcher"
SPORT: Final = "sport"
CHECK_MODE, RELEASE_MODE, SELECT_MODE = 1001, 1003, 1002  # of the motion switcher
API_VERSION: Final = 1  # of every service
STAND_DOWN: Final = 1005  # of sport
OK: Final = 0
UNKNOWN: Final = 3203  # there is no such call


class _RpcBytes(c.Structure):
    _fields_ = (
        ("maximum", c.c_uint32),
        ("length", c.c_uint32),
        ("buffer", c.c_void_p),
        ("release", c.c_bool),
    )


class _RpcRequest(c.Structure):
    _fields_ = (
        ("id", c.c_int64),
        ("api", c.c_int64),
        ("lease", c.c_int64),
        ("priority", c.c_int32),
        ("no_reply", c.c_bool),
        ("text", c.c_char_p),
        ("binary", _RpcBytes),
    )


class _RpcResponse(c.Structure):
    _fields_ = (
        ("id", c.c_int64),
        ("api", c.c_int64),
        ("code", c.c_int32),
        ("text", c.c_char_p),
        ("binary", _RpcBytes),
    )


def _operations(layout: type[c.Structure]) -> list[int]:
    """How the library finds the fields of one of these structs."""
    ops = list[int]()
    for name, kind, *_ in layout._fields_:
        at = getattr(layout, name).offset
        if kind is c.c_char_p:
            ops += string_at(at)
        elif kind is _RpcBytes:
            ops += bytes_at(at)
        else:
            ops += number_at(at, "u" if kind is c.c_bool else "i", c.sizeof(kind))
    return ops


class RpcMessage(NamedTuple):
    """A request or a response.

    Attributes:
        id: number of the request.
        api: which call.
        text: its parameters, or what it gives; usually JSON.
        code: of a response, 0 if all is well.
    """

    id: int
    api: int
    text: str
    code: int = OK


class RpcEnd:
    """One end of a service: it sends messages of one kind and receives those of the other.

    Args:
        participant: of the domain.
        service: its name.
        serves: whether this is the end that responds.

    Attributes:
        service: its name.
    """

    def __init__(self, participant: DdsParticipant, service: str, *, serves: bool) -> None:
        self._participant, self._serves, self.service = participant, serves, service
        layouts = {"request": _RpcRequest, "response": _RpcResponse}
        topics = [
            StructTopic(
                f"rt/api/{service}/{kind}",
                f"unitree_api::msg::dds_::{kind.capitalize()}_",
                c.sizeof(layout),
                c.alignment(layout),
                _operations(layout),
            )
            for kind, layout in layouts.items()
        ]
        self._writer = StructWriter(participant, topics[serves])
        self._reader = StructReader(participant, topics[not serves])

    @property
    def is_linked(self) -> bool:
        """Whether somebody is at the other end: what is sent before is lost."""
        seen, there = self._participant, self._writer.handle
        return bool(seen.readers_seen_by(there) and seen.writers_seen_by(self._reader.handle))

    def send(self, message: RpcMessage) -> bool:
        """Send; whether the library took it."""
        number, api, text, code = message
        sample: Any = _RpcRequest(number, api, text=text.encode())
        if self._serves:
            sample = _RpcResponse(number, api, code, text.encode())
        return self._writer.send(bytes(sample))

    def receive(self) -> Iterator[RpcMessage]:
        """What has come since the last call."""
        layout: Any = _RpcRequest if self._serves else _RpcResponse
        while (raw := self._reader.take()) is not None:
            sample = layout.from_buffer_copy(raw)  # its text is the reader's, until the next
            code = OK if self._serves else int(sample.code)
            text = (sample.text or b"").decode(errors="replace")
            yield RpcMessage(int(sample.id), int(sample.api), text, code)
