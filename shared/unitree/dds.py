"""SHELL of the Go2's network: CycloneDDS's C library through ctypes.

Topics are declared without type information. CycloneDDS's Python package sends it, and what its
version 11 sends ends every process with version 0.10 on the same topics, the robot's own among
them. So that package is never imported: only its library is loaded.
"""

from __future__ import annotations

import ctypes as c
import importlib.util
import zlib
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from quadriga.shared.errors import BridgeError, ConfigError
from quadriga.shared.unitree.codecs import GO2

# Operations of a topic's descriptor: how the library finds the fields of a struct.
_ADDRESS: Final = 1 << 24
_STRING, _SEQUENCE, _ARRAY = 5 << 16, 7 << 16, 8 << 16
_SIZES: Final = {1: 1, 2: 2, 4: 3, 8: 4}  # code of a number by its bytes
_KINDS: Final = {"u": 0, "i": 4, "f": 2}  # flag of a number by numpy's kind
STRING: Final = _ADDRESS | _STRING  # a `char *`; its offset follows
# Maximum, length, buffer, whether it is ours to free; the offset of these follows.
SEQUENCE_OF_BYTES: Final = _ADDRESS | _SEQUENCE | _SIZES[1] << 8
_THERE_ALREADY: Final = -4  # DDS_RETCODE_PRECONDITION_NOT_MET, of a domain
_CONFIG: Final = (
    '<CycloneDDS><Domain Id="any"><General><Interfaces>'
    '<NetworkInterface name="{interface}" priority="default" multicast="default"/>'
    "</Interfaces></General><Discovery><ExternalDomainId>{domain}</ExternalDomainId>{more}"
    "</Discovery></Domain></CycloneDDS>"
)
# The loopback has no multicast: whoever is on this machine is asked one by one.
_LOOPBACK: Final = (
    "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>60"
    '</MaxAutoParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers>'
)
_NUMBERS: Final = 0x7FFFFFFF  # of domains within a process
_KEEP_LAST, _NOT_MINE = 0, 1  # DDS_HISTORY_KEEP_LAST, DDS_IGNORELOCAL_PARTICIPANT
_KEPT: Final = 128  # samples of a reader: a quarter of a second of a robot's reports


def c_struct(**fields: Any) -> Any:
    """A struct in C with these fields."""
    return type("CStruct", (c.Structure,), {"_fields_": list(fields.items())})


_NUMBER, _POINTER = c.c_uint32, c.c_void_p
_Serialised: Final = c_struct(data=_POINTER, size=_NUMBER)
# `dds_topic_descriptor_t`; what is left zero is the type information.
_Descriptor: Final = c_struct(
    **dict.fromkeys(("size", "alignment", "flags", "keys_count"), _NUMBER),
    **{"typename": c.c_char_p, "keys": _POINTER, "ops_count": _NUMBER, "ops": _POINTER},
    **{"meta": c.c_char_p, "type_information": _Serialised, "type_mapping": _Serialised},
    data_representation=_NUMBER,
)
# `dds_sample_info_t`.
_SampleInfo: Final = c_struct(
    **dict.fromkeys(("sample_state", "view_state", "instance_state"), c.c_int),
    **{"valid_data": c.c_bool, "source_timestamp": c.c_int64},
    **dict.fromkeys(("instance", "publication"), c.c_uint64),
    **dict.fromkeys(("disposed", "no_writers", "sample_rank", "generation_rank"), _NUMBER),
    absolute_generation_rank=_NUMBER,
)

_ARGUMENTS: Final = {
    "dds_create_domain": (c.c_uint32, c.c_char_p),
    "dds_create_participant": (c.c_uint32, c.c_void_p, c.c_void_p),
    "dds_create_topic": (c.c_int32, c.c_void_p, c.c_char_p, c.c_void_p, c.c_void_p),
    "dds_create_reader": (c.c_int32, c.c_int32, c.c_void_p, c.c_void_p),
    "dds_create_writer": (c.c_int32, c.c_int32, c.c_void_p, c.c_void_p),
    "dds_take": (c.c_int32, c.c_void_p, c.c_void_p, c.c_size_t, c.c_uint32),
    "dds_write": (c.c_int32, c.c_void_p),
    "dds_delete": (c.c_int32,),
    "dds_create_qos": (),
    "dds_delete_qos": (c.c_void_p,),
    "dds_qset_history": (c.c_void_p, c.c_int, c.c_int32),
    "dds_qset_ignorelocal": (c.c_void_p, c.c_int),
    "dds_get_matched_publications": (c.c_int32, c.c_void_p, c.c_size_t),
    "dds_get_matched_subscriptions": (c.c_int32, c.c_void_p, c.c_size_t),
}


def load_library() -> Any:
    """The C library that CycloneDDS's wheel brings along.

    Raises:
        ConfigError: it is not installed.
    """
    found = importlib.util.find_spec("cyclonedds")  # which does not import it
    place = Path(found.origin).parent if found and found.origin else Path()
    folders = (place.parent / "cyclonedds.libs", place / ".libs")
    files = [path for folder in folders for path in sorted(folder.glob("libddsc*.so*"))]
    if not files:
        cause = "pip install -e '.[go2]'"
        raise ConfigError("the driver of the Go2", "no CycloneDDS", "its library", cause)
    library = c.CDLL(str(files[0]))
    for name, types in _ARGUMENTS.items():
        function = getattr(library, name)
        function.argtypes, function.restype = types, c.c_int32
    library.dds_create_qos.restype = c.c_void_p
    return library


def operations(layout: np.dtype[Any], base: int = 0) -> list[int]:
    """How to find the numbers of a struct; structs within it and arrays of them are laid out flat.

    On the wire that is the same: XCDR1 has neither padding of structs nor marks between them.
    """
    ops = list[int]()
    for field, offset, *_ in (layout.fields or {}).values():
        at, count = base + offset, int(np.prod(field.shape))
        if field.base.names:
            for k in range(count):
                ops += operations(field.base, at + k * field.base.itemsize)
        elif field.shape:
            kind, size = _KINDS[field.base.kind], _SIZES[field.base.itemsize]
            ops += [_ADDRESS | _ARRAY | size << 8 | kind, at, count]
        else:
            ops += number_at(at, field.kind, field.itemsize)
    return ops


def number_at(offset: int, kind: str, size: int) -> list[int]:
    """How to find a number of numpy's `kind` and of `size` bytes at this offset."""
    return [_ADDRESS | _SIZES[size] << 16 | _KINDS[kind], offset]


class StructTopic(NamedTuple):
    """A topic whose samples are structs in C: its name, its type, how the library finds the fields.

    `ops` is made of `operations`, or of `number_at`, `STRING` and `SEQUENCE_OF_BYTES`.
    """

    name: str
    typename: str
    size: int
    alignment: int
    ops: list[int]


def _topic_of(name: str, typename: str, layout: np.dtype[np.void]) -> StructTopic:
    return StructTopic(name, typename, layout.itemsize, layout.alignment, operations(layout))


LOW_COMMANDS: Final = _topic_of("rt/lowcmd", "unitree_go::msg::dds_::LowCmd_", GO2.command)
LOW_STATES: Final = _topic_of("rt/lowstate", "unitree_go::msg::dds_::LowState_", GO2.report)


def describe_topic(topic: StructTopic) -> Any:
    """A topic's descriptor without type information, and what must live as long as it does."""
    program = np.array([*topic.ops, 0], dtype=np.uint32)
    where, name = program.ctypes.data, topic.typename.encode()
    size, alignment = topic.size, topic.alignment
    return _Descriptor(size, alignment, 0, 0, name, None, len(program), where, b""), program


class DdsParticipant:
    """One side's part in a DDS domain. Close it: others keep what is not closed for ten seconds.

    Within a process the library knows a domain on one interface from the same domain on another.

    Args:
        domain: its number; the robot's is 0.
        interface: name of the network interface, such as eth0.

    Raises:
        ConfigError: CycloneDDS is not installed.
        BridgeError: there is no such interface, or the domain cannot be joined.
    """

    def __init__(self, domain: int, interface: str) -> None:
        self.library = load_library()
        more = _LOOPBACK if interface == "lo" else ""
        text = _CONFIG.format(interface=interface, domain=domain, more=more).encode()
        where = f"DDS domain {domain} on {interface!r}"
        inner = zlib.crc32(f"{domain} {interface}".encode()) & _NUMBERS
        self._domain = self.library.dds_create_domain(inner, text)
        if self._domain != _THERE_ALREADY:  # made by another participant of this process
            _check(self._domain, where)
        created = self.library.dds_create_participant(inner, None, None)
        if created < 0:
            self.library.dds_delete(self._domain)
        self.handle = _check(created, where)
        self._kept: list[Any] = []

    def declare(self, topic: StructTopic) -> int:
        """Declare a topic.

        Raises:
            BridgeError: it is there with another type.
        """
        descriptor, program = describe_topic(topic)
        self._kept += [descriptor, program]
        where, name = c.addressof(descriptor), topic.name.encode()
        made = self.library.dds_create_topic(self.handle, where, name, None, None)
        return _check(made, f"DDS topic {topic.name}")

    def close(self) -> None:
        """Leave the domain, and have the others know it."""
        if self.handle >= 0:
            self.library.dds_delete(self.handle)
            if self._domain >= 0:
                self.library.dds_delete(self._domain)
            self.handle = -1


def _check(handle: int, what: str) -> int:
    if handle < 0:
        cause = "is there such an interface? does another process use it with other settings?"
        raise BridgeError(what, f"error {handle} of CycloneDDS", "to be open", cause)
    return handle


class StructReader:
    """Takes samples of a topic: best effort, of the last ones.

    With `of_others` it reads nothing that this participant writes.

    Raises:
        BridgeError: the topic is there with another type.
    """

    def __init__(
        self, participant: DdsParticipant, topic: StructTopic, *, of_others: bool = False
    ) -> None:
        self._library = participant.library
        qos = self._library.dds_create_qos()
        self._library.dds_qset_history(qos, _KEEP_LAST, _KEPT)
        self._library.dds_qset_ignorelocal(qos, _NOT_MINE if of_others else 0)
        declared = participant.declare(topic)
        made = self._library.dds_create_reader(participant.handle, declared, qos, None)
        self._library.dds_delete_qos(qos)
        self._handle = _check(made, "DDS reader")
        self._sample = c.create_string_buffer(topic.size)
        self._samples = (c.c_void_p * 1)(c.addressof(self._sample))
        self._info = _SampleInfo()

    def take(self) -> bytes | None:
        """The oldest sample that has not been taken; None if there is none."""
        where = c.addressof(self._samples), c.addressof(self._info)
        while self._library.dds_take(self._handle, *where, 1, 1) > 0:
            if self._info.valid_data:  # else a writer has left
                return self._sample.raw
        return None

    @property
    def writer(self) -> int:
        """Who wrote the sample that was taken last, a number of this participant's."""
        return int(self._info.publication)

    @property
    def writers(self) -> int:
        """How many writers there are, this participant's own included."""
        return max(0, int(self._library.dds_get_matched_publications(self._handle, None, 0)))


class StructWriter:
    """Writes samples of a topic, reliably."""

    def __init__(self, participant: DdsParticipant, topic: StructTopic) -> None:
        self._library = participant.library
        declared = participant.declare(topic)
        made = self._library.dds_create_writer(participant.handle, declared, None, None)
        self._handle = _check(made, "DDS writer")
        self._sample = c.create_string_buffer(topic.size)

    def send(self, sample: bytes) -> bool:
        """Write; whether the library took it."""
        self._sample.raw = sample
        return bool(self._library.dds_write(self._handle, c.addressof(self._sample)) >= 0)

    @property
    def readers(self) -> int:
        """How many readers there are."""
        return max(0, int(self._library.dds_get_matched_subscriptions(self._handle, None, 0)))
