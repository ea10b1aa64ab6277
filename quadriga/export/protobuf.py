"""Messages as protobuf with named fields, and the descriptors that tell any reader the names."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

from quadriga.export.layout import MessageLayout
from quadriga.shared.robots.conventions import Array

_PACKAGE: Final = "quadriga"
_SAMPLES: Final = "samples"
_Field: Final = descriptor_pb2.FieldDescriptorProto
_TYPES: Final[Mapping[type, int]] = {
    bool: _Field.TYPE_BOOL,
    int: _Field.TYPE_INT64,
    float: _Field.TYPE_DOUBLE,
    str: _Field.TYPE_STRING,
}
_MARK: Final = 0x41235EEDABCD0000  # of a double that nothing else in a message looks like


class ProtobufType:
    """One protobuf message type: plain fields, lists of doubles, and a tree of named doubles.

    Field numbers follow the order of the names.
    """

    def __init__(
        self,
        name: str,
        plain: Sequence[tuple[str, type]],
        lists: Sequence[str],
        numbers: Sequence[str],
        samples: Sequence[str] = (),
    ) -> None:
        """Declare the type.

        Args:
            name: of the type, without the package.
            plain: fields of one value each, `int`, `float` or `str`.
            lists: fields that are repeated doubles.
            numbers: names of doubles; dots make nested messages.
            samples: names of doubles of a repeated field `samples`.
        """
        self.name = f"{_PACKAGE}.{name}"
        file = descriptor_pb2.FileDescriptorProto(
            name=f"{_PACKAGE}/{name}.proto", package=_PACKAGE, syntax="proto3"
        )
        top = file.message_type.add(name=name)
        for field, of in plain:
            _add(top, field, _TYPES[of])
        for field in lists:
            _add(top, field, _Field.TYPE_DOUBLE, repeated=True)
        paths, sampled = ([_split_name(one) for one in names] for names in (numbers, samples))
        _fill(top, self.name, paths)
        if sampled:
            _nest(top, _SAMPLES, self.name, sampled, repeated=True)
        self.descriptor = descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString()
        pool = descriptor_pool.DescriptorPool()
        pool.Add(file)
        self._make: Any = message_factory.GetMessageClass(pool.FindMessageTypeByName(self.name))
        message = self._make()
        self._numbers = _Template(message, message, paths)
        message = self._make()
        if sampled:
            self._samples = _Template(message, getattr(message, _SAMPLES).add(), sampled)

    def encode(
        self, plain: Mapping[str, Any], numbers: Array, samples: Array | None = None
    ) -> bytes:
        """A message with these plain fields and lists, a row of doubles, and one per sample.

        The doubles are put into messages laid out beforehand, at a tenth of the time that
        setting them one by one would take; serialised parts of a message are one message.
        """
        head: bytes = self._make(**plain).SerializeToString()
        body = self._numbers.fill(np.atleast_2d(numbers))
        return head + body + (b"" if samples is None else self._samples.fill(samples))


class _Template:
    """Bytes of a message of doubles, and where in them the bytes of each double are."""

    def __init__(self, message: Any, top: Any, paths: Iterable[tuple[str, ...]]) -> None:
        """Lay out `message` with doubles at `paths` in `top`, which is a part of it or itself."""
        marks = []
        for i, path in enumerate(paths):
            marks.append(struct.pack("<Q", _MARK + i))
            owner = top
            for part in path[:-1]:
                owner = getattr(owner, part)
            setattr(owner, path[-1], struct.unpack("<d", marks[-1])[0])
        body: bytes = message.SerializeToString()
        at = [body.index(mark) + k for mark in marks for k in range(8)]
        self._body, self._at = np.frombuffer(body, np.uint8), np.array(at, dtype=np.intp)

    def fill(self, rows: Array) -> bytes:
        """One message after the other with these numbers, shape (rows, len(paths))."""
        body = np.tile(self._body, (len(rows), 1))
        body[:, self._at] = np.ascontiguousarray(rows, "<f8").view(np.uint8)
        return body.tobytes()


def build_type(layout: MessageLayout) -> ProtobufType:
    """The protobuf type of a kind of message."""
    plain = (("tick", int), *layout.plain)
    cut = layout.sampled
    return ProtobufType(
        layout.kind.__name__, plain, layout.lists, layout.numbers[cut:], layout.numbers[:cut]
    )


def _split_name(name: str) -> tuple[str, ...]:
    """The parts of a name as protobuf allows them: r1-r2 becomes r1_r2."""
    words = (re.sub(r"\W", "_", part, flags=re.ASCII) for part in name.split("."))
    return tuple(word if re.match(r"[A-Za-z_]", word) else f"_{word}" for word in words)


def _fill(message: Any, name: str, paths: Sequence[tuple[str, ...]]) -> None:
    """Add the fields that begin `paths`, in their order, and below them the rest."""
    below: dict[str, list[tuple[str, ...]]] = {}
    for first, *rest in paths:
        below.setdefault(first, []).append(tuple(rest))
    for first, rests in below.items():
        if rests == [()]:
            _add(message, first, _Field.TYPE_DOUBLE)
        else:
            _nest(message, first, name, rests)


def _nest(
    message: Any, field: str, name: str, paths: Sequence[tuple[str, ...]], *, repeated: bool = False
) -> None:
    """Add a field that is a message of its own type, nested in `message` of full name `name`."""
    kind = "".join(word.capitalize() for word in field.split("_")) + "_"
    _fill(message.nested_type.add(name=kind), f"{name}.{kind}", paths)
    _add(message, field, _Field.TYPE_MESSAGE, f".{name}.{kind}", repeated=repeated)


def _add(message: Any, name: str, of: int, of_name: str = "", *, repeated: bool = False) -> None:
    label = _Field.LABEL_REPEATED if repeated else _Field.LABEL_OPTIONAL
    number = len(message.field) + 1
    message.field.add(name=name, number=number, type=of, label=label, type_name=of_name or None)
