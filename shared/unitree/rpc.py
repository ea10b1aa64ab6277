"""The Go2's services: requests and responses with text, over DDS.

A request has a number of its own; the response with this number answers it.
"""

from __future__ import annotations

import ctypes as c
from collections.abc import Iterator
from typing import Any, Final, NamedTuple

from quadriga.shared.unitree.dds import DdsParticipant, SampleInfo, bytes_at, number_at, string_at

MOTION_SWITCHER: Final = "motion_switcher"
SPORT: Final = "sport"
CHECK_MODE, RELEASE_MODE, SELECT_MODE = 1001, 1003, 1002  # of the motion switcher
API_VERSION: Final = 1  # of every service
STAND_DOWN: Final = 1005  # of sport
OK: Final = 0
UNKNOWN: Final = 3203  # there is no such call

_REQUEST_TYPE: Final = "unitree_api::msg::dds_::Request_"
_RESPONSE_TYPE: Final = "unitree_api::msg::dds_::Response_"
_INT64, _INT32, _BOOL = ("i", 8), ("i", 4), ("u", 1)  # numpy's kind, and bytes


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
        ("parameter", c.c_char_p),
        ("binary", _RpcBytes),
    )


class _RpcResponse(c.Structure):
    _fields_ = (
        ("id", c.c_int64),
        ("api", c.c_int64),
        ("code", c.c_int32),
        ("data", c.c_char_p),
        ("binary", _RpcBytes),
    )


def _operations(layout: Any, numbers: dict[str, tuple[str, int]], text: str) -> list[int]:
    ops = list[int]()
    for name, (kind, size) in numbers.items():
        ops += number_at(getattr(layout, name).offset, kind, size)
    return [*ops, *string_at(getattr(layout, text).offset), *bytes_at(layout.binary.offset)]


_REQUEST_OPS: Final = _operations(
    _RpcRequest,
    {"id": _INT64, "api": _INT64, "lease": _INT64, "priority": _INT32, "no_reply": _BOOL},
    "parameter",
)
_RESPONSE_OPS: Final = _operations(
    _RpcResponse, {"id": _INT64, "api": _INT64, "code": _INT32}, "data"
)


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
        self._participant, self._library, self.service = participant, participant.library, service
        topics = {
            kind: participant.topic(
                f"rt/api/{service}/{kind}", typename, c.sizeof(layout), c.alignment(layout), ops
            )
            for kind, typename, layout, ops in (
                ("request", _REQUEST_TYPE, _RpcRequest, _REQUEST_OPS),
                ("response", _RESPONSE_TYPE, _RpcResponse, _RESPONSE_OPS),
            )
        }
        mine, others = ("response", "request") if serves else ("request", "response")
        self._serves = serves
        self._writer, self._reader = (
            participant.writer(topics[mine]),
            participant.reader(topics[others]),
        )
        self._sample: Any = _RpcRequest() if serves else _RpcResponse()
        self._samples = (c.c_void_p * 1)(c.addressof(self._sample))
        self._info = SampleInfo()

    @property
    def is_linked(self) -> bool:
        """Whether somebody is at the other end: what is sent before is lost."""
        seen = self._participant
        return bool(seen.readers_seen_by(self._writer) and seen.writers_seen_by(self._reader))

    def send(self, message: RpcMessage) -> bool:
        """Send; whether the library took it."""
        if self._serves:
            sample: Any = _RpcResponse(message.id, message.api, message.code, message.text.encode())
        else:
            sample = _RpcRequest(message.id, message.api, parameter=message.text.encode())
        return bool(self._library.dds_write(self._writer, c.addressof(sample)) >= 0)

    def receive(self) -> Iterator[RpcMessage]:
        """What has come since the last call."""
        where = c.addressof(self._samples), c.addressof(self._info)
        while self._library.dds_take(self._reader, *where, 1, 1) > 0:
            if not self._info.valid_data:
                continue
            sample = self._sample
            text = (sample.parameter if self._serves else sample.data) or b""
            code = OK if self._serves else int(sample.code)
            yield RpcMessage(int(sample.id), int(sample.api), text.decode(errors="replace"), code)
