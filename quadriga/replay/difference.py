"""Where a recomputed message departs from the recorded one: field, place, both values."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from quadriga.shared.codec import decode
from quadriga.shared.errors import MessageError
from quadriga.shared.messages import Message
from quadriga.shared.robots.conventions import Array


@dataclass(frozen=True, slots=True)
class Difference:
    """The first field in which two messages differ.

    Attributes:
        tick: of the step that gave the message.
        name: of its topic, or its key.
        field: name of the field, with the place of an array's first differing entry.
        recorded, recomputed: the two values as text.
        others: how many entries of the same array differ as well, or names of other fields.
    """

    tick: int
    name: str
    field: str
    recorded: str
    recomputed: str
    others: str = ""

    def __str__(self) -> str:
        rest = f" ({self.others})" if self.others else ""
        place = f"{self.name}.{self.field}" if self.field else self.name
        return (
            f"tick {self.tick}, {place}: "
            f"recorded {self.recorded}, recomputed {self.recomputed}{rest}"
        )


def find_difference(tick: int, name: str, recorded: bytes, message: Message) -> Difference:
    """How a recomputed message differs from what was recorded in its place.

    Args:
        tick: of the step.
        name: of the message's topic, or its key.
        recorded: the payload in its place.
        message: recomputed; of a payload with other bytes.
    """
    try:
        old = decode(recorded, type(message))
    except MessageError as error:
        return Difference(tick, name, "", f"what is no message ({error})", "one")
    differing = [item for item in fields(message) if not _same(old, message, item.name)]
    if not differing:
        return Difference(tick, name, "", "the same values", "in another order on the wire")
    item = differing[0]
    also = ", ".join(other.name for other in differing[1:])
    was, now = getattr(old, item.name), getattr(message, item.name)
    if "shape" not in item.metadata or was.shape != now.shape:
        one, other = (repr(v.shape if "shape" in item.metadata else v) for v in (was, now))
        return Difference(tick, name, item.name, one, other, f"also in {also}" if also else "")
    places = np.argwhere(_bits(was) != _bits(now))
    place = tuple(int(k) for k in places[0])
    others = [f"{len(places)} of {was.size} entries differ" if was.size > 1 else ""]
    others += [f"also in {also}"] if also else []
    return Difference(
        tick,
        name,
        f"{item.name}[{', '.join(map(str, place))}]",
        repr(float(was[place])),
        repr(float(now[place])),
        "; ".join(filter(None, others)),
    )


def _bits(array: Array) -> NDArray[np.uint64]:
    return np.ascontiguousarray(array, dtype="<f8").view(np.uint64)


def _same(one: Message, other: Message, name: str) -> bool:
    first, second = getattr(one, name), getattr(other, name)
    if isinstance(first, np.ndarray):
        return first.shape == np.shape(second) and bool((_bits(first) == _bits(second)).all())
    return bool(first == second)
