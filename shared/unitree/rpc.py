"""The Go2's services: requests and responses with text, over DDS.

A request has a number of its own; the response with this number answers it.
"""

from __future__ import annotations

import ctypes as c
from collections.abc import Iterator
from typing import Any, Final, NamedTuple

from quadriga.shared.unitree.dds import (
    SEQUENCE_OF_BYTES,
    STRING,
    DdsParticipant,
    StructReader,
    StructTopic,
    StructWriter,
    c_struct,
    number_at,
)

MOTION_SWITCHER: Final = "motion_switcher"
SPORT: Final = "sport"
CHECK_MODE, RELEASE_MODE, SELECT_MODE = 1001, 1003, 1002  # of the motion switcher
API_VERSION: Final = 1  # of every service
STAND_DOWN: Final = 1005  # of sport
OK: Final = 0
UNKNOWN: Final = 3203  # there is no such call


_LONG, _INT, _TEXT = c.c_int64, c.c_int32, c.c_char_p
_RpcBytes: Final = c_struct(
    maximum=c.c_uint32, length=c.c_uint32, buffer=c.c_void_p, release=c.c_bool
)
_RpcRequest: Final = c_struct(
    id=_LONG, api=_LONG, lease=_LONG, priority=_INT, no_reply=c.c_bool, text=_TEXT, binary=_RpcBytes
)
_RpcResponse: Final = c_struct(id=_LONG, api=_LONG, code=_INT, text=_TEXT, binary=_RpcBytes)


def _topic(service: str, kind: str, layout: Any) -> StructTopic:
    ops = list[int]()
    for name, of in layout._fields_:
        at = getattr(layout, name).offset
        if of is _TEXT:
            ops += [STRING, at]
        elif of is _RpcBytes:
            ops += [SEQUENCE_OF_BYTES, at]
        else:
            ops += number_at(at, "u" if of is c.c_bool else "i", c.sizeof(of))
    typename = f"unitree_api::msg::dds_::{kind}_"
    name = f"rt/api/{service}/{kind.lower()}"
    return StructTopic(name, typename, c.sizeof(layout), c.alignment(layout), ops)


class RpcMessage(NamedTuple):
    """A request or a response."""

    id: int  # number of the request
    api: int  # which call
    text: str  # its parameters, or what it gives; usually JSON
    code: int = OK  # of a response, 0 if all is well


class RpcEnd:
    """One end of a service: it sends messages of one kind and receives those of the other.

    The end that `serves` responds.
    """

    def __init__(self, participant: DdsParticipant, service: str, *, serves: bool) -> None:
        self._serves, self.service = serves, service
        request = _topic(service, "Request", _RpcRequest)
        response = _topic(service, "Response", _RpcResponse)
        written, read = (response, request) if serves else (request, response)
        self._writer = StructWriter(participant, written)
        self._reader = StructReader(participant, read)

    @property
    def is_linked(self) -> bool:
        """Whether somebody is at the other end: what is sent before is lost."""
        return bool(self._writer.readers and self._reader.writers)

    def send(self, message: RpcMessage) -> bool:
        """Send; whether the library took it."""
        number, api, text, code = message
        sample = _RpcRequest(number, api, text=text.encode())
        if self._serves:
            sample = _RpcResponse(number, api, code, text.encode())
        return self._writer.send(bytes(sample))

    def receive(self) -> Iterator[RpcMessage]:
        """What has come since the last call."""
        layout = _RpcRequest if self._serves else _RpcResponse
        while (raw := self._reader.take()) is not None:
            sample = layout.from_buffer_copy(raw)  # its text is the reader's, until the next
            code = OK if self._serves else int(sample.code)
            text = (sample.text or b"").decode(errors="replace")
            yield RpcMessage(int(sample.id), int(sample.api), text, code)
